"""Learn how sure a Whisper's words are, from recordings whose words are known.

A logistic function is fitted to the figures that the model gives for each reading and to whether
its words were right; other talk, of which nothing should be understood, counts as wrong. A weak
pull towards the weights of an unmeasured model keeps a few recordings from making it sure of
everything.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.manifest import Calibration
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.store import StoredModel
from vla_deploy.speech.errors import RecordingsInvalid
from vla_deploy.speech.recogniser import open_recogniser
from vla_deploy.speech.recording import sound_of
from vla_deploy.speech.sound import Sound
from vla_deploy.speech.transcript import UNCALIBRATED, Transcript, confidence, evidence_of
from vla_deploy.speech.words import words_of

LEAST: Final = 20
_PULL: Final = 0.2
_STEPS: Final = 50
KnownSound = tuple[Sound, tuple[str, ...]]
"""A recording and its words; none for sound of which nothing should be understood."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """Hold what was learnt: mean squared error of the confidence before and after, 0 to 1."""

    calibration: Calibration
    recordings: int
    right: int
    error_before: float
    error_after: float


def known_recordings(folder: Path) -> list[KnownSound]:
    """Return the WAV files of a folder, each with the words of the text file of its name.

    Raises:
        RecordingsInvalid: there are too few, or one has no text file.
        DriverError: one is no WAV file of 16-bit samples.
        SpeechMissing: one has another rate, and PyAV is not installed.
    """
    paths = sorted(folder.glob("*.wav"))
    wordless = [path.name for path in paths if not path.with_suffix(".txt").is_file()]
    if len(paths) < LEAST or wordless:
        raise RecordingsInvalid(
            f"{folder}: expected {LEAST} WAV files at least, each with its words in a .txt beside "
            f"it (empty for other sound); got {len(paths)}, without words: {wordless[:3]}"
        )
    return [
        (sound_of(path), words_of(path.with_suffix(".txt").read_text(encoding="utf-8")))
        for path in paths
    ]


def calibrate(
    model: StoredModel, choice: ModelChoice, known: Sequence[KnownSound], *, beam: int, clock: Clock
) -> Calibrated:
    """Read every recording and learn how sure the model's words are.

    Raises:
        InferenceError: the model cannot be opened, or fails.
        SpeechMissing: faster-whisper is not installed.
    """
    recogniser = open_recogniser(model, choice, beam=beam, clock=clock)
    try:
        readings = [recogniser.read(sound) for sound, _ in known]
    finally:
        recogniser.close()
    right = [
        bool(words) and words_of(reading.text) == words
        for (_, words), reading in zip(known, readings, strict=True)
    ]
    return learn(readings, right, recogniser.declared.calibration)


def learn(
    readings: Sequence[Transcript], right: Sequence[bool], before: Calibration | None = None
) -> Calibrated:
    """Fit the weights to readings and whether they are right; those without words teach nothing."""
    pairs = [pair for pair in zip(readings, right, strict=True) if pair[0].text]
    evidence = np.array([evidence_of(reading) for reading, _ in pairs]).reshape(-1, 4)
    truth = np.array([float(is_right) for _, is_right in pairs])
    fitted = _fitted(evidence, truth)
    return Calibrated(
        calibration=fitted,
        recordings=len(readings),
        right=sum(right),
        error_before=_error(readings, right, before),
        error_after=_error(readings, right, fitted),
    )


def keep(model: StoredModel, calibration: Calibration) -> None:
    """Write the weights into the manifest of a model that was added.

    Raises:
        ModelUnknown: it comes with the software.
        OSError: the manifest cannot be written.
    """
    name = model.manifest.name
    if model.is_embedded or model.manifest.whisper is None:
        raise ModelUnknown(f"{name} was not added as a Whisper: only those are calibrated here")
    whisper = dataclasses.replace(model.manifest.whisper, calibration=calibration)
    write_manifest(model.folder, dataclasses.replace(model.manifest, whisper=whisper))


def _fitted(evidence: NDArray[np.float64], truth: NDArray[np.float64]) -> Calibration:
    """Return the weights by Newton's method, pulled towards those of an unmeasured model."""
    start = np.array(dataclasses.astuple(UNCALIBRATED))
    weights = start.copy()
    for _ in range(_STEPS):
        sure = 1.0 / (1.0 + np.exp(-np.clip(evidence @ weights, -50.0, 50.0)))
        slope = evidence.T @ (sure - truth) + _PULL * (weights - start)
        curve = (evidence.T * (sure * (1.0 - sure))) @ evidence + _PULL * np.eye(len(start))
        step = np.linalg.solve(curve, slope)
        weights -= step / max(1.0, float(np.abs(step).max()))
    names = [field.name for field in dataclasses.fields(Calibration)]
    return Calibration(**dict(zip(names, (round(float(one), 4) for one in weights), strict=True)))


def _error(
    readings: Sequence[Transcript], right: Sequence[bool], calibration: Calibration | None
) -> float:
    sure = np.array([confidence(reading, calibration) for reading in readings])
    return float(np.mean((sure - np.array(right, dtype=float)) ** 2))
