"""Add a person's Whisper in CTranslate2's form, and measure what it costs."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference import opening
from vla_deploy.inference.errors import ModelFileSpoiled
from vla_deploy.inference.manifest import Manifest, Whisper
from vla_deploy.inference.manifest_schema import SPEECH_TO_TEXT, VOCABULARIES, WHISPER_PARTS
from vla_deploy.inference.store import ModelStore, StoredModel
from vla_deploy.model_tools.keeping import FolderSource, keep_folder, require_free
from vla_deploy.speech.recogniser import Recogniser, open_recogniser
from vla_deploy.speech.recording import sound_of
from vla_deploy.speech.sound import RATE_HZ, Sound
from vla_deploy.speech.transcript import Transcript

PARTS: Final = (*WHISPER_PARTS, *VOCABULARIES, "preprocessor_config.json")
PLAIN_CHOICE: Final = dataclasses.replace(opening.PLAIN_CHOICE, precision="int8")
"""To look at a model by itself, as no profile is needed for."""
_LENGTHS_S: Final = (1.0, 3.0, 6.0)
_MOST_S: Final = 29.0


@dataclass(frozen=True, slots=True, kw_only=True)
class WhisperSource(FolderSource):
    """Hold what a person says of a Whisper."""

    whisper: Whisper


def add_whisper(
    store: ModelStore, source: WhisperSource, *, clock: Clock, replace: bool = False
) -> tuple[StoredModel, Transcript]:
    """Check a model, try it out and keep it; when anything is wrong, nothing has changed.

    Returns the model, and what it reads in a second of silence.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelFileSpoiled: a file is missing, or they are no Whisper.
        RunFailed: it cannot run.
        SpeechMissing: faster-whisper is not installed.
        OSError: the model cannot be stored.
    """
    require_free(store, source.name, replace=replace)
    return keep_folder(store, source, describe(source), lambda model: try_out(model, clock))


def describe(source: WhisperSource) -> Manifest:
    """Return the manifest for a folder of files.

    Raises:
        ModelFileSpoiled: one of those that are needed is missing, or cannot be read.
    """
    there = [name for name in PARTS if (source.folder / name).is_file()]
    missing = [name for name in WHISPER_PARTS if name not in there]
    missing += [] if any(name in there for name in VOCABULARIES) else [VOCABULARIES[0]]
    if missing:
        raise ModelFileSpoiled(
            f"{source.folder}: {', '.join(missing)} missing; expected a Whisper as CTranslate2 "
            "converts it: ct2-transformers-converter --model MODEL --output_dir DIR "
            "--quantization int8 --copy_files tokenizer.json preprocessor_config.json"
        )
    return source.manifest(SPEECH_TO_TEXT, there, whisper=source.whisper)


def try_out(model: StoredModel, clock: Clock, choice: ModelChoice = PLAIN_CHOICE) -> Transcript:
    """Return what a model reads in a second of silence.

    Raises:
        InferenceError: it does not run; each kind says why.
        SpeechMissing: faster-whisper is not installed.
    """
    recogniser = open_recogniser(model, choice, beam=1, clock=clock)
    try:
        return recogniser.read(np.zeros(RATE_HZ, np.float32))
    finally:
        recogniser.close()


def bench(
    model: StoredModel,
    choice: ModelChoice,
    sounds: Mapping[str, Sound],
    *,
    beam: int,
    rounds: int,
    clock: Clock,
) -> dict[str, Any]:
    """Read each sound so many times; return the figures, as JSON takes them.

    `memory_mb` is by how much the process grew to load the model; a row has the figures of one
    sound, `real_time_factor` is time taken per time of sound.

    Raises:
        InferenceError: the model cannot be opened, or fails.
        SpeechMissing: faster-whisper is not installed.
    """
    recogniser = open_recogniser(model, choice, beam=beam, clock=clock)
    try:
        return {
            "model": model.manifest.name,
            "provider": recogniser.provider,
            "threads": choice.threads,
            "beam": beam,
            "load_s": recogniser.load_s,
            "memory_mb": recogniser.memory_mb,
            "rows": [_row(recogniser, name, sounds[name], rounds) for name in sounds],
        }
    finally:
        recogniser.close()


def noises() -> dict[str, Sound]:
    """Return faint noise of several lengths: it costs the encoder what speech does."""
    draw = np.random.default_rng(0)
    return {
        f"noise {length_s:g} s": 0.01
        * draw.standard_normal(round(length_s * RATE_HZ)).astype(np.float32)
        for length_s in _LENGTHS_S
    }


def recordings(paths: Sequence[Path]) -> dict[str, Sound]:
    """Return recordings as the recogniser takes them, at most 29 s of each.

    Raises:
        DriverError: a file is missing, or no WAV file of 16-bit samples.
        SpeechMissing: one has another rate, and PyAV is not installed.
    """
    return {path.name: sound_of(path)[: round(_MOST_S * RATE_HZ)] for path in paths}


def _row(recogniser: Recogniser, name: str, sound: Sound, rounds: int) -> dict[str, Any]:
    read = [recogniser.read(sound) for _ in range(rounds)]
    took_s, duration_s = [one.took_s for one in read], len(sound) / RATE_HZ
    return {
        "sound": name,
        "duration_s": duration_s,
        "reads": rounds,
        "median_s": float(np.median(took_s)),
        "p95_s": float(np.percentile(took_s, 95)),
        "real_time_factor": float(np.median(took_s)) / max(duration_s, 1e-3),
        "text": read[-1].text,
    }
