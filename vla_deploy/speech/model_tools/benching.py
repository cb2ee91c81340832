"""Measure what a Whisper costs on phrases of several lengths, or on recordings of one's own."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.audio.wav import read_wav
from drivers.clock import NS_PER_S, Clock
from platforms import ModelChoice
from vla_deploy.inference.store import Model
from vla_deploy.speech.recogniser import Recogniser, open_recogniser
from vla_deploy.speech.resampling import Resampler
from vla_deploy.speech.sound import RATE_HZ, Sound

LENGTHS_S: Final = (1.0, 3.0, 6.0)
MOST_S: Final = 29.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """Hold the figures of one sound; `real_time_factor` is time taken per time of sound."""

    sound: str
    duration_s: float
    reads: int
    median_s: float
    p95_s: float
    real_time_factor: float
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """Hold the figures of one model; `memory_mb` is by how much the process grew to load it."""

    model: str
    provider: str
    threads: int
    beam: int
    load_s: float
    memory_mb: float
    rows: tuple[Row, ...]

    def document(self) -> dict[str, Any]:
        """Return the figures, as JSON takes them."""
        return asdict(self)


def bench(
    model: Model,
    choice: ModelChoice,
    sounds: Mapping[str, Sound],
    *,
    beam: int,
    rounds: int,
    clock: Clock,
) -> Bench:
    """Read each sound so many times, in turn.

    Raises:
        InferenceError: the model cannot be opened, or fails.
        SpeechMissing: faster-whisper is not installed.
    """
    recogniser = open_recogniser(model, choice, beam=beam, clock=clock)
    try:
        return Bench(
            model=model.manifest.name,
            provider=recogniser.provider,
            threads=choice.threads,
            beam=beam,
            load_s=recogniser.load_s,
            memory_mb=recogniser.memory_mb,
            rows=_rows(recogniser, sounds, rounds, clock),
        )
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


def _rows(
    recogniser: Recogniser, sounds: Mapping[str, Sound], rounds: int, clock: Clock
) -> tuple[Row, ...]:
    took_s: dict[str, list[float]] = {name: [] for name in sounds}
    texts: dict[str, str] = {}
    for _ in range(rounds):
        for name, sound in sounds.items():
            started_ns = clock.now_ns()
            texts[name] = recogniser.read(sound).text
            took_s[name].append((clock.now_ns() - started_ns) / NS_PER_S)
    return tuple(
        Row(
            sound=name,
            duration_s=len(sound) / RATE_HZ,
            reads=rounds,
            median_s=float(np.median(took_s[name])),
            p95_s=float(np.percentile(took_s[name], 95)),
            real_time_factor=float(np.median(took_s[name])) * RATE_HZ / max(1, len(sound)),
            text=texts[name],
        )
        for name, sound in sounds.items()
    )
