"""Carry out `vla-deploy models` for a detector: add, measure, quantise and calibrate it."""

import argparse
import dataclasses
from collections.abc import Mapping
from typing import Final

from platforms import Profile
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.models.arguments import Result, choice_of
from vla_deploy.inference.errors import AccuracyLost
from vla_deploy.inference.manifest import Fit, Measured, Variant
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.detectors.accuracy import Accuracy, measure_files, worst
from vla_deploy.model_tools.detectors.adding import DetectorSource, add_model, empty_images
from vla_deploy.model_tools.detectors.benching import ModelFigures, bench
from vla_deploy.model_tools.detectors.labelled import read_image, read_labelled, spread_paths
from vla_deploy.model_tools.detectors.quantising import quantise, require_disjoint

_BENCH_IMAGES: Final = 32


def add(arguments: argparse.Namespace, shelf: ModelShelf) -> Result:
    """Check a detector, try it out and keep it."""
    source = DetectorSource(
        name=arguments.name,
        onnx=arguments.onnx,
        classes=arguments.classes,
        adapter=arguments.adapter,
        size_px=arguments.size,
        summary=arguments.summary or "a detector that was added",
        licence=arguments.licence,
        card=arguments.card,
        colour=arguments.colour,
        fit=Fit(arguments.fit),
        fill=arguments.fill,
        scale=arguments.scale,
        mean=tuple(arguments.mean),
        std=tuple(arguments.std),
        score_threshold=arguments.score,
        iou_threshold=arguments.iou,
    )
    model, trial = add_model(
        shelf.store, source, engines=shelf.engines, clock=shelf.clock, replace=arguments.replace
    )
    detection = model.manifest.detection
    assert detection is not None, "only detectors are added"
    document: dict[str, object] = {
        "name": arguments.name,
        "folder": str(model.folder),
        "adapter": detection.adapter,
        "classes": list(detection.classes),
        "boxes_in_empty_images": dict(trial.boxes),
    }
    text = (
        f"added {arguments.name} in {model.folder}: adapter {detection.adapter}, "
        f"{len(detection.classes)} classes; {trial}\n"
        f"next: vla-deploy models quantise {arguments.name} ..., or calibrate: until it is "
        "measured on labelled images, it names nothing by itself; then name it in a profile: "
        f'[models.detector] tiers = ["{arguments.name}"]'
    )
    return document, text


def measure(
    arguments: argparse.Namespace, shelf: ModelShelf, model: StoredModel, profile: Profile
) -> Result:
    """Measure what each file of a detector costs."""
    choice = choice_of(arguments, model, profile, PLAIN_CHOICE)
    images = (
        [read_image(path) for path in spread_paths(arguments.images, _BENCH_IMAGES)]
        if arguments.images
        else [empty_images()["noise"]]
    )
    figures = bench(shelf, model, choice, images, arguments.rounds)
    return figures.document(), _bench_text(figures)


def quantise_model(arguments: argparse.Namespace, shelf: ModelShelf, model: StoredModel) -> Result:
    """Make the int8 files and install them with the fp32 file.

    Raises:
        CommandFailed: the detector sees worse than allowed; nothing was installed.
    """
    if model.is_embedded and not arguments.new_name:
        raise UsageError(f"{arguments.name} comes with the software; name your own by --as NAME")
    classes = model.manifest.detection.classes if model.manifest.detection else ()
    labelled = read_labelled(arguments.labelled, classes)
    calibration = spread_paths(arguments.images, arguments.limit)
    require_disjoint(calibration, labelled)
    try:
        done = quantise(
            shelf.store,
            model,
            name=arguments.new_name or arguments.name,
            calibration=calibration,
            labelled=labelled,
            max_drop_points=arguments.max_drop,
            engines=shelf.engines,
            clock=shelf.clock,
        )
    except AccuracyLost as error:
        raise CommandFailed(str(error)) from error
    measured = next(iter(done.accuracy.values()))
    last = (
        f"over {measured.images} images with {measured.things} things; drop "
        f"{done.drop_points:.2f} points; installed as {done.model}"
    )
    return done.document(), "\n".join([*_accuracy_lines(done.accuracy), last])


def calibrate_model(arguments: argparse.Namespace, shelf: ModelShelf) -> Result:
    """Measure an added detector on labelled images, and write the result into its manifest."""
    model = shelf.store.load(arguments.name)
    if model.is_embedded or model.manifest.detection is None:
        raise UsageError(f"{arguments.name} was not added as a detector: nothing to measure")
    labelled = read_labelled(arguments.labelled, model.manifest.detection.classes)
    accuracy = measure_files(model, labelled, engines=shelf.engines, clock=shelf.clock)
    document = {variant: dataclasses.asdict(one) for variant, one in accuracy.items()}
    last = f"written to the manifest of {arguments.name}"
    return document, "\n".join([*_accuracy_lines(accuracy), last])


def _accuracy_lines(accuracy: Mapping[Variant, Accuracy]) -> list[str]:
    """Return mAP by file, then precision and recall by class of the worst file, with counts."""
    measured: Measured = worst(accuracy).measured
    return [
        *(f"{variant:<10} mAP50 {one.map50:.4f}" for variant, one in accuracy.items()),
        f"{'class':<20} {'precision':>9} {'of boxes':>8} {'recall':>9} {'of things':>9}",
        *(
            f"{one.name:<20} {one.precision:>9.3f} {one.boxes:>8} {one.recall:>9.3f} "
            f"{one.things:>9}"
            for one in measured.classes
        ),
    ]


def _bench_text(figures: ModelFigures) -> str:
    head = (
        f"{'file':<10} {'provider':<26} {'run':>9} {'p95':>9} {'frame':>9} {'p95':>9} {'memory':>9}"
    )
    rows = [
        f"{row.variant:<10} {row.provider:<26} {_ms(row.run_median_s)} {_ms(row.run_p95_s)} "
        f"{_ms(row.frame_median_s)} {_ms(row.frame_p95_s)} {row.memory_mb:>6.1f} MB"
        for row in figures.rows
    ]
    notices = [f"note: {notice}" for row in figures.rows for notice in row.notices]
    speedup = figures.int8_speedup
    last = [] if speedup is None else [f"int8 runs {speedup:.2f} times as fast as fp32"]
    return "\n".join([head, *rows, *notices, *last, f"threads: {figures.threads}"])


def _ms(value_s: float) -> str:
    return f"{1000 * value_s:>6.2f} ms"
