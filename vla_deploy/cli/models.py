"""`vla-deploy models`: add, fetch, list, measure, quantise and verify models."""

import argparse
import dataclasses
import json
import sys
from collections import defaultdict
from collections.abc import Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import ModelChoice, Profile, load_profile
from platforms.profile import profile_names
from vla_deploy.cli import models_detector, models_language, models_whisper
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.models_arguments import Run, register_acts
from vla_deploy.inference.errors import AccuracyLost, InferenceError
from vla_deploy.inference.manifest import Fit, ModelFile
from vla_deploy.inference.manifest_file import document_of
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.detectors.adding import DetectorSource, add_model
from vla_deploy.model_tools.detectors.benching import ModelFigures, bench
from vla_deploy.model_tools.detectors.images import read_image, spread_paths
from vla_deploy.model_tools.detectors.labelled import read_labelled
from vla_deploy.model_tools.detectors.quantising import quantise
from vla_deploy.model_tools.detectors.trial import empty_images
from vla_deploy.model_tools.published import WHISPERS
from vla_deploy.model_tools.verifying import ModelFinding, verify
from vla_deploy.supervisor.profiles.profile_choice import start_profile
from vla_deploy.supervisor.runs.runtime import default_base

_BENCH_IMAGES: Final = 32
_BYTES_PER_MB: Final = 2**20


def register(commands: Any) -> None:
    """Add the command."""
    register_acts(commands, RUNS)


def list_models(arguments: argparse.Namespace) -> int:
    """Print every model, where it comes from, and which profiles use it."""
    shelf, uses = _shelf(arguments), _uses()
    rows = [_row(shelf, name, uses.get(name, [])) for name in shelf.store.names()]
    missing = [name for name in uses if name not in shelf.store.names()]
    rows += [_missing_row(name, uses[name]) for name in sorted(missing)]
    lines = [f"{'model':<20} {'role':<15} {'from':<10} {'files':<30} used by"]
    for row in rows:
        used = ", ".join(_short(row["used_by"])) or "-"
        files = row["fault"] or ", ".join(row["files"])
        lines.append(f"{row['name']:<20} {row['role']:<15} {row['from']:<10} {files:<30} {used}")
    return _tell(arguments, rows, "\n".join(lines))


def show_model(arguments: argparse.Namespace) -> int:
    """Print what a model is."""
    model = _shelf(arguments).store.load(arguments.name)
    card = str(model.folder / model.manifest.card) if model.manifest.card else ""
    document = {
        **document_of(model.manifest),
        "folder": str(model.folder),
        "card": card,
        "used_by": _uses().get(arguments.name, []),
    }
    return _tell(arguments, document, json.dumps(document, indent=2, ensure_ascii=False))


def add(arguments: argparse.Namespace) -> int:
    """Check a model, try it out and keep it."""
    shelf = _shelf(arguments)
    if arguments.whisper is not None:
        return _tell(arguments, *models_whisper.add(arguments, shelf))
    if arguments.language is not None:
        return _tell(arguments, *models_language.add(arguments, shelf, _profile(arguments)))
    model, trial = add_model(
        shelf.store,
        _source(arguments),
        engines=shelf.engines,
        clock=shelf.clock,
        replace=arguments.replace,
    )
    detection = model.manifest.detection
    assert detection is not None, "only detectors are added"
    document = {
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
    return _tell(arguments, document, text)


def fetch(arguments: argparse.Namespace) -> int:
    """Fetch a published model, check it, try it out and keep it."""
    if (arguments.name is None) is (arguments.language is None):
        raise UsageError(
            "expected the NAME of a published model, or --language OWNER/REPO[:FOLDER]"
        )
    shelf = _shelf(arguments)
    if arguments.name in WHISPERS:
        if arguments.new_name or arguments.revision or arguments.licence:
            raise UsageError("--as, --revision and --licence are for language models")
        done = models_whisper.fetch_whisper(arguments, shelf, partial(_progress, arguments))
    else:
        profile = _profile(arguments)
        done = models_language.fetch(arguments, shelf, profile, partial(_progress, arguments))
    return _tell(arguments, *done)


def remove(arguments: argparse.Namespace) -> int:
    """Delete a model that was added."""
    _shelf(arguments).store.remove(arguments.name)
    return _tell(arguments, {"removed": arguments.name}, f"removed {arguments.name}")


def bench_model(arguments: argparse.Namespace) -> int:
    """Measure a model's files beside each other."""
    shelf = _shelf(arguments)
    model = shelf.store.load(arguments.name)
    if model.manifest.whisper is not None:
        told = models_whisper.measure(arguments, shelf, model, _profile(arguments))
        return _tell(arguments, *told)
    if model.manifest.language is not None:
        told = models_language.measure(arguments, shelf, model, _profile(arguments))
        return _tell(arguments, *told)
    choice = _choice(model, _profile(arguments))
    if arguments.threads:
        choice = dataclasses.replace(choice, threads=arguments.threads)
    images = (
        [read_image(path) for path in spread_paths(arguments.images, _BENCH_IMAGES)]
        if arguments.images
        else [empty_images()["noise"]]
    )
    figures = bench(shelf, model, choice, images, arguments.rounds)
    return _tell(arguments, figures.document(), _bench_text(figures))


def quantise_model(arguments: argparse.Namespace) -> int:
    """Make the int8 files and keep them if the model still sees as well."""
    shelf = _shelf(arguments)
    model = shelf.store.load(arguments.name)
    if model.manifest.whisper is not None:
        raise UsageError(f"{arguments.name} is a Whisper: CTranslate2 quantises as it converts")
    if model.manifest.language is not None:
        raise UsageError(f"{arguments.name} is a language model: its exporter quantises it")
    if model.is_embedded and not arguments.new_name:
        raise UsageError(f"{arguments.name} comes with the software; name your own by --as NAME")
    classes = model.manifest.detection.classes if model.manifest.detection else ()
    labelled = read_labelled(arguments.labelled, classes)
    calibration = spread_paths(arguments.images, arguments.limit)
    models_detector.require_others(calibration, labelled)
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
    return _tell(arguments, done.document(), models_detector.quantised_text(done))


def calibrate(arguments: argparse.Namespace) -> int:
    """Learn how sure a detector's or a recogniser's words are."""
    shelf = _shelf(arguments)
    if arguments.labelled is not None:
        return _tell(arguments, *models_detector.calibrate_detector(arguments, shelf))
    profile = _profile(arguments)
    return _tell(arguments, *models_whisper.calibrate_whisper(arguments, shelf, profile))


def verify_models(arguments: argparse.Namespace) -> int:
    """Check models; return 1 when a check failed."""
    shelf = _shelf(arguments)
    profile = _profile(arguments)
    findings: list[ModelFinding] = []
    for name in arguments.names or shelf.store.names():
        findings += verify(shelf, name, profile if _concerns(shelf, name, profile) else None)
    lines = [
        f"{'ok  ' if one.is_ok else 'FAIL'} {one.model:<20} {one.check:<24} {one.detail}"
        for one in findings
    ]
    _tell(arguments, [dataclasses.asdict(one) for one in findings], "\n".join(lines) or "no model")
    return 0 if all(one.is_ok for one in findings) else 1


RUNS: Final[Mapping[str, Run]] = {
    "list": list_models,
    "show": show_model,
    "add": add,
    "fetch": fetch,
    "calibrate": calibrate,
    "remove": remove,
    "bench": bench_model,
    "quantise": quantise_model,
    "verify": verify_models,
}


def _shelf(arguments: argparse.Namespace) -> ModelShelf:
    base: Path = arguments.runtime_base or default_base()
    return ModelShelf.of_base(base, MonotonicClock())


def _progress(arguments: argparse.Namespace, line: str) -> None:
    if not arguments.json:
        print(line, file=sys.stderr, flush=True)


def _profile(arguments: argparse.Namespace) -> Profile:
    return load_profile(arguments.profile or start_profile(arguments.runtime_base).name)


def _choice(model: StoredModel, profile: Profile) -> ModelChoice:
    """Return what a profile says of the model's role; one that says nothing gets the CPU."""
    return profile.models.get(model.manifest.role, PLAIN_CHOICE)


def _concerns(shelf: ModelShelf, name: str, profile: Profile) -> bool:
    """Tell whether a profile has a say on a model: on one of a role that it declares."""
    try:
        return shelf.store.load(name).manifest.role in profile.models
    except InferenceError:
        return False  # `verify` tells what is wrong with it


def _source(arguments: argparse.Namespace) -> DetectorSource:
    return DetectorSource(
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


def _uses() -> dict[str, list[str]]:
    """Return, for each model that a profile names, where it does: profile, role, tier."""
    uses: dict[str, list[str]] = defaultdict(list)
    for name in profile_names():
        for role, choice in load_profile(name).models.items():
            for tier, model in enumerate(choice.tiers):
                uses[model].append(f"{name} {role} tier {tier}")
    return dict(uses)


def _row(shelf: ModelShelf, name: str, used_by: list[str]) -> dict[str, Any]:
    try:
        model = shelf.store.load(name)
    except InferenceError as error:
        fault = str(error).partition("\n")[0]
        return {**_missing_row(name, used_by), "from": "spoiled", "fault": fault}
    sizes = {
        str(variant): _size_mb(model.folder / file.path)
        for variant, file in model.manifest.files.items()
    }
    sizes |= {part.path: _size_mb(model.folder / part.path) for part in _weights(model)}
    return {
        "name": name,
        "role": model.manifest.role,
        "from": "software" if model.is_embedded else "added",
        "files": sizes,
        "licence": model.manifest.licence,
        "used_by": used_by,
        "fault": "",
    }


def _weights(model: StoredModel) -> tuple[ModelFile, ...]:
    """Return the part of a model of several that its size is in."""
    endings = (".bin", ".onnx", ".data", "_data")
    return tuple(part for part in model.manifest.parts if part.path.endswith(endings))


def _missing_row(name: str, used_by: list[str]) -> dict[str, Any]:
    role = used_by[0].split()[1] if used_by else ""
    return {
        "name": name,
        "role": role,
        "from": "missing",
        "files": {},
        "licence": "",
        "used_by": used_by,
        "fault": "named by profiles only",
    }


def _size_mb(path: Path) -> float | None:
    return round(path.stat().st_size / _BYTES_PER_MB, 2) if path.is_file() else None


def _short(used_by: list[str], most: int = 3) -> list[str]:
    shown = list(islice(used_by, most))
    return [*shown, f"{len(used_by) - most} more"] if len(used_by) > most else shown


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


def _tell(arguments: argparse.Namespace, document: object, text: str) -> int:
    sys.stdout.write((json.dumps(document, indent=2) if arguments.json else text) + "\n")
    return 0
