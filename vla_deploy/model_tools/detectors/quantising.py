"""Quantise a detector to int8 with a person's images, and keep it only if it still sees as well."""

import dataclasses
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.clock import Clock
from vla_deploy.inference.errors import (
    AccuracyLost,
    ImagesInvalid,
    ModelMismatch,
)
from vla_deploy.inference.manifest import DetectionOutputs, Manifest, ModelFile, Variant
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of
from vla_deploy.model_tools.detectors.accuracy import Accuracy
from vla_deploy.model_tools.detectors.images import read_image
from vla_deploy.model_tools.detectors.int8_files import TYPES, Feed, write_int8
from vla_deploy.model_tools.detectors.labelled import LabelledImage
from vla_deploy.model_tools.detectors.measuring import measure, with_measured
from vla_deploy.perception.detectors.image_input import fit_image


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantised:
    """Hold how well each file sees."""

    model: str
    accuracy: Mapping[Variant, Accuracy]
    drop_points: float

    def document(self) -> dict[str, Any]:
        """Return the figures, as JSON takes them."""
        return dataclasses.asdict(self)


def quantise(
    store: ModelStore,
    model: StoredModel,
    *,
    name: str,
    calibration: Sequence[Path],
    labelled: Sequence[LabelledImage],
    max_drop_points: float,
    engines: Path,
    clock: Clock,
) -> Quantised:
    """Make both int8 files from the fp32 one and install them under a name with it.

    The manifest tells what the boxes of the file that sees worst are worth.

    Raises:
        AccuracyLost: mAP50 drops by more than `max_drop_points` percent; nothing was installed.
        PackageMissing: the packages to quantise with are not installed.
        ModelUnknown: the name cannot be used.
        ModelMismatch: it is no detector, or has no fp32 file.
        ModelFileSpoiled: its fp32 file is not what was checked in, or cannot be quantised.
        ImagesInvalid: there is nothing to calibrate or to measure with.
    """
    detection = model.manifest.detection
    if detection is None or Variant.FP32 not in model.manifest.files:
        raise ModelMismatch(model.manifest.name, ("expected a detector with an fp32 file",))
    if not calibration or not labelled:
        raise ImagesInvalid("expected images to calibrate and labelled ones to measure with")
    source = model.checked_file(Variant.FP32)
    draft = store.draft(name)
    try:
        _copy_original(model, source, draft, name)
        paths = {variant: draft / f"{name}_{variant}.onnx" for variant in TYPES}
        write_int8(source, paths, lambda: _inputs(model.manifest, detection, calibration))
        made = _describe(model, draft, name, paths)
        accuracy = {
            variant: measure(made, variant, labelled, engines=engines, clock=clock)
            for variant in (Variant.FP32, *TYPES)
        }
        drop_points = _judge(accuracy, max_drop_points)
        write_manifest(draft, with_measured(made.manifest, accuracy))
        store.install(draft)
    finally:
        store.abandon(draft)
    return Quantised(model=name, accuracy=accuracy, drop_points=drop_points)


def require_disjoint(calibration: Sequence[Path], labelled: Sequence[LabelledImage]) -> None:
    """Check that no labelled image is one to calibrate with: on those a file sees better.

    Raises:
        ImagesInvalid: some are.
    """
    known = {path.resolve() for path in calibration}
    shared = [one.path for one in labelled if one.path.resolve() in known]
    if shared:
        raise ImagesInvalid(
            f"--labelled: {len(shared)} of its {len(labelled)} images, such as {shared[0]}, are "
            "among those of --images; expected others, which it was not calibrated with"
        )


def _copy_original(model: StoredModel, source: Path, draft: Path, name: str) -> None:
    shutil.copyfile(source, draft / f"{name}.onnx")
    if model.manifest.card:
        shutil.copyfile(model.folder / model.manifest.card, draft / model.manifest.card)


def _describe(
    model: StoredModel, draft: Path, name: str, paths: Mapping[Variant, Path]
) -> StoredModel:
    every = {Variant.FP32: draft / f"{name}.onnx", **paths}
    files = {
        variant: ModelFile(path=path.name, sha256=sha256_of(path))
        for variant, path in every.items()
    }
    manifest = dataclasses.replace(model.manifest, name=name, files=files)
    return StoredModel(manifest=manifest, folder=draft)


def _judge(accuracy: Mapping[Variant, Accuracy], max_drop_points: float) -> float:
    """Return by how many percent mAP50 drops.

    Raises:
        AccuracyLost: by more than is allowed.
    """
    before = accuracy[Variant.FP32].map50
    drops = {variant: 100.0 * (before - accuracy[variant].map50) for variant in TYPES}
    worst = max(drops, key=lambda variant: drops[variant])
    if drops[worst] > max_drop_points:
        figures = ", ".join(f"{variant} {one.map50:.4f}" for variant, one in accuracy.items())
        raise AccuracyLost(
            f"mAP50 of {worst} drops by {drops[worst]:.2f} points, allowed are {max_drop_points:g} "
            f"({figures}); nothing was installed; calibrate with more images of what the robot sees"
        )
    return drops[worst]


def _inputs(
    manifest: Manifest, detection: DetectionOutputs, images: Sequence[Path]
) -> Iterator[Feed]:
    (tensor,) = manifest.inputs
    for path in images:
        fitted, _ = fit_image(read_image(path), detection.image, tensor.dtype)
        yield {tensor.name: fitted}
