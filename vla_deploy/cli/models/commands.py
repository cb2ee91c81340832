"""`vla-deploy models`: add, fetch, list, measure, quantise and verify models.

What depends on the kind of a model is in `detector`, `whisper`, `language` and `embedder`.
"""

import argparse
import dataclasses
import json
import sys
from collections.abc import Mapping
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import Profile, load_profile
from vla_deploy.cli.commands import Run, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.models import detector, embedder, language, whisper
from vla_deploy.cli.models.arguments import register_acts
from vla_deploy.cli.session import base_of
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.manifest_file import document_of
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.model_tools.listing import model_rows, profile_uses
from vla_deploy.model_tools.published import TEXT_EMBEDDERS, WHISPERS
from vla_deploy.model_tools.verifying import verify
from vla_deploy.supervisor.profiles.profile_choice import start_profile

_MOST_USES: Final = 3


def register(commands: Any) -> None:
    """Add the command."""
    register_acts(commands, _RUNS)


def list_models(arguments: argparse.Namespace) -> int:
    """Print every model, where it comes from, and which profiles use it."""
    rows = model_rows(_shelf(arguments).store)
    lines = [f"{'model':<20} {'role':<15} {'from':<10} {'files':<30} used by"]
    for row in rows:
        used_by, more = row["used_by"][:_MOST_USES], len(row["used_by"]) - _MOST_USES
        used = ", ".join([*used_by, f"{more} more"] if more > 0 else used_by) or "-"
        files = row["fault"] or ", ".join(row["files"])
        lines.append(f"{row['name']:<20} {row['role']:<15} {row['from']:<10} {files:<30} {used}")
    return emit(arguments, rows, "\n".join(lines))


def show_model(arguments: argparse.Namespace) -> int:
    """Print the manifest of a model, its folder, and which profiles use it."""
    model = _shelf(arguments).store.load(arguments.name)
    document = {
        **document_of(model.manifest),
        "folder": str(model.folder),
        "card": str(model.folder / model.manifest.card) if model.manifest.card else "",
        "used_by": profile_uses().get(arguments.name, []),
    }
    return emit(arguments, document, json.dumps(document, indent=2, ensure_ascii=False))


def add(arguments: argparse.Namespace) -> int:
    """Check a model, try it out and keep it."""
    shelf = _shelf(arguments)
    if arguments.whisper is not None:
        result = whisper.add(arguments, shelf)
    elif arguments.language is not None:
        result = language.add(arguments, shelf, _profile(arguments))
    elif arguments.embedder is not None:
        result = embedder.add(arguments, shelf, _profile(arguments))
    else:
        result = detector.add(arguments, shelf)
    return emit(arguments, *result)


def fetch(arguments: argparse.Namespace) -> int:
    """Fetch a published model, check it, try it out and keep it."""
    if (arguments.name is None) is (arguments.language is None):
        raise UsageError(
            "expected the NAME of a published model, or --language OWNER/REPO[:FOLDER]"
        )

    def report(line: str) -> None:
        if not arguments.json:
            print(line, file=sys.stderr, flush=True)

    shelf = _shelf(arguments)
    if arguments.name in WHISPERS:
        return emit(arguments, *whisper.fetch(arguments, shelf, report))
    if arguments.name in TEXT_EMBEDDERS:
        return emit(arguments, *embedder.fetch(arguments, shelf, _profile(arguments), report))
    return emit(arguments, *language.fetch(arguments, shelf, _profile(arguments), report))


def remove(arguments: argparse.Namespace) -> int:
    """Delete a model that was added."""
    _shelf(arguments).store.remove(arguments.name)
    return emit(arguments, {"removed": arguments.name}, f"removed {arguments.name}")


def bench(arguments: argparse.Namespace) -> int:
    """Measure what a model costs, each of a detector's files."""
    shelf, profile = _shelf(arguments), _profile(arguments)
    model = shelf.store.load(arguments.name)
    if model.manifest.whisper is not None:
        result = whisper.measure(arguments, shelf, model, profile)
    elif model.manifest.language is not None:
        result = language.measure(arguments, shelf, model, profile)
    elif model.manifest.embedding is not None:
        raise UsageError(f"{arguments.name} is a text embedder: nothing is measured of these")
    else:
        result = detector.measure(arguments, shelf, model, profile)
    return emit(arguments, *result)


def quantise(arguments: argparse.Namespace) -> int:
    """Make the int8 files of a detector, and keep them if it still sees as well."""
    shelf = _shelf(arguments)
    model = shelf.store.load(arguments.name)
    if model.manifest.whisper is not None:
        raise UsageError(f"{arguments.name} is a Whisper: CTranslate2 quantises as it converts")
    if model.manifest.language is not None:
        raise UsageError(f"{arguments.name} is a language model: its exporter quantises it")
    if model.manifest.embedding is not None:
        raise UsageError(f"{arguments.name} is a text embedder: its exporter quantises it")
    return emit(arguments, *detector.quantise_model(arguments, shelf, model))


def calibrate(arguments: argparse.Namespace) -> int:
    """Measure how reliable a detector's classes or a recogniser's words are."""
    shelf = _shelf(arguments)
    if arguments.labelled is not None:
        return emit(arguments, *detector.calibrate_model(arguments, shelf))
    return emit(arguments, *whisper.calibrate_model(arguments, shelf, _profile(arguments)))


def verify_models(arguments: argparse.Namespace) -> int:
    """Check models; return 1 when a check failed."""
    shelf, profile = _shelf(arguments), _profile(arguments)
    findings = [
        finding
        for name in arguments.names or shelf.store.names()
        for finding in verify(shelf, name, profile if _concerns(profile, shelf, name) else None)
    ]
    lines = [
        f"{'ok  ' if one.is_ok else 'FAIL'} {one.model:<20} {one.check:<24} {one.detail}"
        for one in findings
    ]
    document = [dataclasses.asdict(one) for one in findings]
    emit(arguments, document, "\n".join(lines) or "no model")
    return 0 if all(one.is_ok for one in findings) else 1


_RUNS: Final[Mapping[str, Run]] = {
    "list": list_models,
    "show": show_model,
    "add": add,
    "fetch": fetch,
    "calibrate": calibrate,
    "remove": remove,
    "bench": bench,
    "quantise": quantise,
    "verify": verify_models,
}


def _shelf(arguments: argparse.Namespace) -> ModelShelf:
    return ModelShelf.of_base(base_of(arguments), MonotonicClock())


def _profile(arguments: argparse.Namespace) -> Profile:
    return load_profile(arguments.profile or start_profile(arguments.runtime_base).name)


def _concerns(profile: Profile, shelf: ModelShelf, name: str) -> bool:
    """Return whether a profile declares the role of a model."""
    try:
        return shelf.store.load(name).manifest.role in profile.models
    except InferenceError:
        return False  # `verify` reports the fault
