"""Measure what a Whisper costs on phrases of several lengths, or on recordings of one's own."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.audio.wav import read_wav
from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference.store import Model
from vla_deploy.speech.microphone import Resampler
from vla_deploy.speech.recogniser import Recogniser, open_recogniser
from vla_deploy.speech.sound import RATE_HZ, Sound

LENGTHS_S: Final = (1.0, 3.0, 6.0)
MOST_S: Final = 29.0


def bench(
    model: Model,
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
        for length_s in LENGTHS_S
    }


def recordings(paths: Sequence[Path]) -> dict[str, Sound]:
    """Return recordings as the recogniser takes them, at most 29 s of each.

    Raises:
        DriverError: a file is missing, or no WAV file of 16-bit samples.
        SpeechMissing: one has another rate, and PyAV is not installed.
    """
    return {path.name: sound_of(path)[: round(MOST_S * RATE_HZ)] for path in paths}


def sound_of(path: Path) -> Sound:
    """Return a WAV file as one channel at 16 kHz.

    Raises:
        DriverError: it is missing, or no WAV file of 16-bit samples.
        SpeechMissing: it has another rate, and PyAV is not installed.
    """
    format_, samples = read_wav(path)
    return Resampler(format_).feed(samples)


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
