"""Carry out `vla-deploy models` for a Whisper: add, fetch, measure and calibrate it."""

import argparse
import dataclasses
import json
from collections.abc import Callable
from typing import Any

from platforms import Profile
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.models.arguments import Result, choice_of
from vla_deploy.inference.manifest import EncoderContext, Whisper
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.published import WHISPERS, fetched
from vla_deploy.model_tools.whisper_calibration import calibrate, keep, known_recordings
from vla_deploy.model_tools.whispers import (
    PLAIN_CHOICE,
    WhisperSource,
    add_whisper,
    bench,
    noises,
    recordings,
)


def add(arguments: argparse.Namespace, shelf: ModelShelf) -> Result:
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
    return _kept(arguments, shelf, source)


def fetch(
    arguments: argparse.Namespace, shelf: ModelShelf, report: Callable[[str], None]
) -> Result:
    """Fetch a published Whisper, check it, try it out and keep it."""
    if arguments.new_name or arguments.revision or arguments.licence:
        raise UsageError("--as, --revision and --licence are for language models")
    published = WHISPERS[arguments.name]
    with fetched(published, shelf.store, report, arguments.endpoint) as (folder, licence):
        source = WhisperSource(
            name=arguments.name,
            folder=folder,
            whisper=Whisper(languages=("en",), context=EncoderContext.PADDED),
            summary=published.summary,
            licence=licence,
        )
        return _kept(arguments, shelf, source)


def measure(
    arguments: argparse.Namespace, shelf: ModelShelf, model: StoredModel, profile: Profile
) -> Result:
    """Measure what a Whisper costs."""
    choice = choice_of(arguments, model, profile, PLAIN_CHOICE)
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


def calibrate_model(arguments: argparse.Namespace, shelf: ModelShelf, profile: Profile) -> Result:
    """Measure how reliable a Whisper's confidence is, and write the result into its manifest."""
    model = shelf.store.load(arguments.name)
    if model.is_embedded or model.manifest.whisper is None:
        raise UsageError(f"{arguments.name} was not added as a Whisper: nothing to calibrate")
    choice = profile.models.get(model.manifest.role, PLAIN_CHOICE)
    known = known_recordings(arguments.sounds)
    done = calibrate(model, choice, known, beam=profile.speech.beam, clock=shelf.clock)
    keep(model, done.calibration)
    text = (
        f"{done.right} of {done.recordings} recordings were read rightly; mean squared error of "
        f"the confidence {done.error_before:.3f} before, {done.error_after:.3f} now"
    )
    return dataclasses.asdict(done), text


def _kept(arguments: argparse.Namespace, shelf: ModelShelf, source: WhisperSource) -> Result:
    model, silence = add_whisper(shelf.store, source, clock=shelf.clock, replace=arguments.replace)
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
