"""Do what `vla-deploy models` does with a Whisper: add, fetch and measure it."""

import argparse
import dataclasses
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from platforms import ModelChoice, Profile
from vla_deploy.cli.errors import UsageError
from vla_deploy.inference.manifest import EncoderContext, Whisper
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.published import WHISPERS, fetch
from vla_deploy.model_tools.whisper_calibration import calibrate, keep, known_recordings
from vla_deploy.model_tools.whispers import (
    PLAIN_CHOICE,
    WhisperSource,
    add_whisper,
    bench,
    noises,
    recordings,
)
from vla_deploy.speech.transcript import Transcript

Told = tuple[dict[str, object], str]


def add(arguments: argparse.Namespace, shelf: ModelShelf) -> Told:
    """Check a Whisper, try it out and keep it."""
    source = WhisperSource(
        name=arguments.name,
        folder=arguments.whisper,
        whisper=Whisper(
            languages=tuple(arguments.languages.split(",")),
            context=EncoderContext.TRIMMED if arguments.trimmed else EncoderContext.PADDED,
        ),
        summary=arguments.summary or "a recogniser that was added",
        licence=arguments.licence,
        card=arguments.card,
    )
    return _told(*add_whisper(shelf.store, source, clock=shelf.clock, replace=arguments.replace))


def fetch_whisper(
    arguments: argparse.Namespace, shelf: ModelShelf, tell: Callable[[str], None]
) -> Told:
    """Fetch a published Whisper, check it, try it out and keep it."""
    with tempfile.TemporaryDirectory(prefix="vla-deploy-fetch-") as directory:
        published = WHISPERS[arguments.name]
        folder, licence = fetch(published, Path(directory), tell, arguments.endpoint)
        source = WhisperSource(
            name=arguments.name,
            folder=folder,
            whisper=Whisper(languages=("en",), context=EncoderContext.PADDED),
            summary=published.summary,
            licence=licence,
        )
        return _told(
            *add_whisper(shelf.store, source, clock=shelf.clock, replace=arguments.replace)
        )


def measure(
    arguments: argparse.Namespace, shelf: ModelShelf, model: StoredModel, profile: Profile
) -> Told:
    """Measure what a Whisper costs."""
    choice: ModelChoice = profile.models.get(model.manifest.role, PLAIN_CHOICE)
    if arguments.threads:
        choice = dataclasses.replace(choice, threads=arguments.threads)
    sounds = recordings(sorted(arguments.sounds.glob("*.wav"))) if arguments.sounds else noises()
    figures = bench(
        model,
        choice,
        sounds,
        beam=profile.speech.beam,
        rounds=arguments.rounds,
        clock=shelf.clock,
    )
    return figures, _bench_text(figures)


def calibrate_whisper(arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile) -> Told:
    """Learn how sure a Whisper's words are, and keep that in its manifest."""
    model = shelf.store.load(arguments.name)
    if model.is_embedded or model.manifest.whisper is None:
        raise UsageError(f"{arguments.name} was not added as a Whisper: nothing to calibrate")
    choice: ModelChoice = profile.models.get(model.manifest.role, PLAIN_CHOICE)
    known = known_recordings(arguments.sounds)
    done = calibrate(model, choice, known, beam=profile.speech.beam, clock=shelf.clock)
    keep(model, done.calibration)
    text = (
        f"{done.right} of {done.recordings} recordings were read rightly; mean squared error of "
        f"the confidence {done.error_before:.3f} before, {done.error_after:.3f} now"
    )
    return dataclasses.asdict(done), text


def _told(model: StoredModel, silence: Transcript) -> Told:
    name = model.manifest.name
    document: dict[str, object] = {
        "name": name,
        "folder": str(model.folder),
        "reads_in_silence": silence.text,
        "no_speech": silence.no_speech,
        "took_s": silence.took_s,
    }
    tiers = json.dumps(list(dict.fromkeys((name, "commands-whisper"))))
    text = (
        f"added {name} in {model.folder}; a second of silence took "
        f"{1000 * silence.took_s:.0f} ms and reads {silence.text!r}\n"
        f"next: vla-deploy models bench {name}, then name it in a profile: "
        f"[models.speech_to_text] tiers = {tiers}"
    )
    return document, text


def _bench_text(figures: dict[str, Any]) -> str:
    rows = [
        f"{row['sound']:<20} {row['duration_s']:>5.1f} s {1000 * row['median_s']:>8.1f} ms "
        f"{1000 * row['p95_s']:>8.1f} ms {row['real_time_factor']:>6.3f}  {row['text']}"
        for row in figures["rows"]
    ]
    return "\n".join(
        [
            f"{'sound':<20} {'length':>7} {'median':>11} {'p95':>11} {'factor':>6}  text",
            *rows,
            f"{figures['provider']}, {figures['threads']} threads, beam {figures['beam']}; "
            f"loaded in {figures['load_s']:.2f} s, {figures['memory_mb']:.0f} MB",
        ]
    )
