"""Measure detectors for `vla-deploy models`, and tell what their boxes are worth."""

import argparse
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from vla_deploy.cli.errors import UsageError
from vla_deploy.inference.manifest import Measured, Variant
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.model_tools.detectors.accuracy import Accuracy
from vla_deploy.model_tools.detectors.labelled import LabelledImage, read_labelled
from vla_deploy.model_tools.detectors.measuring import measure_files, worst
from vla_deploy.model_tools.detectors.quantising import Quantised

Told = tuple[object, str]


def calibrate_detector(arguments: argparse.Namespace, shelf: ModelShelf) -> Told:
    """Measure an added detector on labelled images, and keep that in its manifest."""
    model = shelf.store.load(arguments.name)
    if model.is_embedded or model.manifest.detection is None:
        raise UsageError(f"{arguments.name} was not added as a detector: nothing to measure")
    labelled = read_labelled(arguments.labelled, model.manifest.detection.classes)
    accuracy = measure_files(model, labelled, engines=shelf.engines, clock=shelf.clock)
    document = {variant: dataclasses.asdict(one) for variant, one in accuracy.items()}
    lines = [*_map_lines(accuracy), *worth_lines(worst(accuracy).measured)]
    return document, "\n".join([*lines, f"written to the manifest of {arguments.name}"])


def require_others(calibration: Sequence[Path], labelled: Sequence[LabelledImage]) -> None:
    """Accept labelled images that are none of those to calibrate with.

    Raises:
        UsageError: some are: on what it was fitted to, a file sees better than elsewhere.
    """
    known = {path.resolve() for path in calibration}
    shared = [one.path for one in labelled if one.path.resolve() in known]
    if shared:
        raise UsageError(
            f"--labelled: {len(shared)} of its {len(labelled)} images, such as {shared[0]}, are "
            "among those of --images; expected others, which it was not calibrated with"
        )


def quantised_text(done: Quantised) -> str:
    """Return what quantising has brought, for people."""
    measured = next(iter(done.accuracy.values()))
    told = (
        f"over {measured.images} images with {measured.things} things; drop "
        f"{done.drop_points:.2f} points; installed as {done.model}"
    )
    return "\n".join(
        [*_map_lines(done.accuracy), *worth_lines(worst(done.accuracy).measured), told]
    )


def worth_lines(measured: Measured) -> list[str]:
    """Return a table of precision and recall by class, with the counts behind them."""
    head = f"{'class':<20} {'precision':>9} {'of boxes':>8} {'recall':>9} {'of things':>9}"
    rows = [
        f"{one.name:<20} {one.precision:>9.3f} {one.boxes:>8} {one.recall:>9.3f} {one.things:>9}"
        for one in measured.classes
    ]
    return [head, *rows]


def _map_lines(accuracy: Mapping[Variant, Accuracy]) -> list[str]:
    return [f"{variant:<10} mAP50 {one.map50:.4f}" for variant, one in accuracy.items()]
