"""Measure how good a detector is on labelled images: its boxes, at an overlap of one half.

The robot weighs a network's words by the figures in its manifest: without them the network may
support a name, and gives none.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch, ModelUnknown
from vla_deploy.inference.manifest import ClassMeasured, Manifest, Measured, Variant
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.detectors.labelled import LabelledImage, Labels
from vla_deploy.perception.detectors.boxes import Boxes, iou
from vla_deploy.perception.detectors.detector import Detector

HIT_IOU: Final = 0.5
# Precision over recall needs the boxes that a robot would not act on, too.
_MEASURING_SCORE: Final = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Hold average precision at IoU 0.5, 0..1: for each class that occurs, and their mean.

    `measured` is what the boxes from the threshold on are worth.
    """

    map50: float
    by_class: Mapping[str, float]
    measured: Measured
    images: int
    things: int


class AccuracyCount:
    """Collect what was found and what was there, image by image.

    Average precision takes boxes of every score, `measured` only those from the threshold on.
    """

    def __init__(self, classes: tuple[str, ...], score_threshold: float = 0.0) -> None:
        self._classes = classes
        self._threshold = score_threshold
        self._scores: list[list[float]] = [[] for _ in classes]
        self._hits: list[list[bool]] = [[] for _ in classes]
        self._present = [0] * len(classes)
        self._images = 0

    def add(self, found: Boxes, labels: Labels) -> None:
        """Count one image: the surest box of a class takes the thing that it overlaps most."""
        self._images += 1
        for number in range(len(self._classes)):
            boxes = found.where(found.classes == number)
            truth = labels.corners_px[labels.classes == number]
            self._present[number] += len(truth)
            self._scores[number].extend(boxes.scores.tolist())
            self._hits[number].extend(_hits(boxes, truth))

    def result(self) -> Accuracy:
        """Return the accuracy over all images.

        Raises:
            ImagesInvalid: nothing was labelled.
        """
        by_class = {
            name: average_precision(self._scores[number], self._hits[number], self._present[number])
            for number, name in enumerate(self._classes)
            if self._present[number]
        }
        if not by_class:
            raise ImagesInvalid(f"nothing is labelled in {self._images} images: no accuracy")
        return Accuracy(
            map50=float(np.mean(list(by_class.values()))),
            by_class=by_class,
            measured=self._measured(),
            images=self._images,
            things=sum(self._present),
        )

    def _measured(self) -> Measured:
        counts = [self._count(number) for number in range(len(self._classes))]
        hits, boxes, things = (sum(column) for column in zip(*counts, strict=True))
        return Measured(
            precision=_share(hits, boxes),
            recall=_share(hits, things),
            boxes=boxes,
            things=things,
            classes=tuple(
                _class_measured(name, *count)
                for name, count in zip(self._classes, counts, strict=True)
                if any(count)
            ),
        )

    def _count(self, number: int) -> tuple[int, int, int]:
        """Return how many boxes of a class are right, how many there are, and how many things."""
        sure = np.array(self._scores[number]) >= self._threshold
        hits = np.array(self._hits[number], dtype=bool) & sure
        return int(hits.sum()), int(sure.sum()), self._present[number]


def _class_measured(name: str, hits: int, boxes: int, things: int) -> ClassMeasured:
    return ClassMeasured(
        name=name,
        precision=_share(hits, boxes),
        recall=_share(hits, things),
        boxes=boxes,
        things=things,
    )


def _share(part: int, whole: int) -> float:
    """Return a share as a manifest states it; 0 of nothing."""
    return round(part / whole, 3) if whole else 0.0


def average_precision(scores: Iterable[float], hits: Iterable[bool], present: int) -> float:
    """Return the area under precision over recall, where precision never rises with recall."""
    order = np.argsort(-np.array(list(scores)), kind="stable")
    right = np.array(list(hits), dtype=bool)[order]
    true = np.cumsum(right)
    precision: NDArray[np.float64] = true / np.arange(1, len(true) + 1)
    best_from_here = np.maximum.accumulate(precision[::-1])[::-1]
    return float(best_from_here[right].sum() / present)


def _hits(boxes: Boxes, truth: NDArray[np.float32]) -> list[bool]:
    """Return for each box, the surest first, whether it is the first on a thing."""
    free = np.ones(len(truth), dtype=bool)
    hits = []
    for box in boxes.corners_px:
        overlaps = np.where(free, iou(box, truth), 0.0)
        best = int(overlaps.argmax()) if len(truth) else -1
        hit = best >= 0 and bool(overlaps[best] >= HIT_IOU)
        if hit:
            free[best] = False
        hits.append(hit)
    return hits


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
