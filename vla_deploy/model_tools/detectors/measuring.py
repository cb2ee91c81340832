"""Measure how good a detector is on a person's labelled images, and write that into its manifest.

The robot weighs a network's words by these figures: without them it may support a name and gives
none.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch, ModelUnknown
from vla_deploy.inference.manifest import Manifest, Variant
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.detectors.accuracy import Accuracy, AccuracyCount
from vla_deploy.model_tools.detectors.labelled import LabelledImage
from vla_deploy.perception.detectors.detector import Detector

# Precision over recall needs the boxes that a robot would not act on, too.
_MEASURING_SCORE: Final = 0.01


def measure_files(
    model: StoredModel, labelled: Sequence[LabelledImage], *, engines: Path, clock: Clock
) -> dict[Variant, Accuracy]:
    """Measure every file of a detector that was added, and write down what it is worth.

    Raises:
        ModelUnknown: it comes with the software, whose figures stay as they were published.
        ModelMismatch: it is no detector.
        ImagesInvalid: there is nothing to measure with.
        InferenceError: a file cannot be run.
        OSError: the manifest cannot be written.
    """
    manifest = model.manifest
    if model.is_embedded:
        raise ModelUnknown(f"{manifest.name} comes with the software: only added ones are measured")
    if manifest.detection is None:
        raise ModelMismatch(manifest.name, (f"expected a detector, its role is {manifest.role}",))
    if not labelled:
        raise ImagesInvalid("expected labelled images to measure with")
    accuracy = {
        variant: measure(model, variant, labelled, engines=engines, clock=clock)
        for variant in manifest.files
    }
    write_manifest(model.folder, with_measured(manifest, accuracy))
    return accuracy


def with_measured(manifest: Manifest, accuracy: Mapping[Variant, Accuracy]) -> Manifest:
    """Return a detector's manifest with what was measured of the file that sees worst."""
    assert manifest.detection is not None, "only detectors are measured"
    detection = dataclasses.replace(manifest.detection, measured=worst(accuracy).measured)
    return dataclasses.replace(manifest, detection=detection)


def worst(accuracy: Mapping[Variant, Accuracy]) -> Accuracy:
    """Return how well the file sees that sees worst."""
    return min(accuracy.values(), key=lambda one: one.map50)


def measure(
    model: StoredModel,
    variant: Variant,
    labelled: Sequence[LabelledImage],
    *,
    engines: Path,
    clock: Clock,
) -> Accuracy:
    """Return how well one file of a detector sees, run on the CPU.

    Raises:
        InferenceError: it cannot be run, or nothing is labelled.
    """
    detection = model.manifest.detection
    assert detection is not None, "only detectors are measured"
    keen = dataclasses.replace(detection, weak_score_threshold=_MEASURING_SCORE)
    manifest = dataclasses.replace(model.only(variant).manifest, detection=keen)
    keen_model = dataclasses.replace(model, manifest=manifest)
    detector = Detector(open_session(keen_model, PLAIN_CHOICE, engines=engines, clock=clock))
    count = AccuracyCount(detection.classes, detection.score_threshold)
    try:
        for image in labelled:
            rgb, labels = image.read()
            count.add(detector.detect(rgb), labels)
    finally:
        detector.close()
    return count.result()
