"""Judge a recogniser as the robot runs it: errors by voice and noise, speed, what it is sure of."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from training.speech.errors_of_words import Count, count
from training.speech.trials import (
    by_foreigners,
    by_held_out_voices,
    by_known_voices,
    by_styles,
    by_unseen_engine,
    heard,
    noises_alone,
    sentences,
)
from training.voices import kokoro
from training.voices.clip import SpokenClip
from training.voices.errors import EngineMissing
from vla_deploy.speech.recogniser import Recogniser
from vla_deploy.speech.transcript import Transcript, confidence

NOISY_DB: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Read:
    """Hold what was said, and what was read of it."""

    clip: SpokenClip
    reading: Transcript
    cpu_s: float

    @property
    def is_exact(self) -> bool:
        """Return whether every word is right."""
        return count([(self.clip.text, self.reading.text)]).exact == 1


def read_all(recogniser: Recogniser, clips: Sequence[SpokenClip]) -> list[Read]:
    """Read clips one by one."""
    return [_read(recogniser, clip) for clip in clips]


def _read(recogniser: Recogniser, clip: SpokenClip) -> Read:
    began_s = time.process_time()
    reading = recogniser.read(clip.samples)
    return Read(clip=clip, reading=reading, cpu_s=time.process_time() - began_s)


def count_of(reads: Sequence[Read]) -> Count:
    """Count the errors in readings."""
    return count((one.clip.text, one.reading.text) for one in reads)


def word_errors(recogniser: Recogniser, most: int, seed: int) -> tuple[dict[str, Any], list[Read]]:
    """Return the word error rates over the sets of voices and noise, and all the readings.

    Figures of an engine that is not installed are None; `missing` says what to install.
    """
    texts = sentences("commands")[:most]
    figures: dict[str, Any] = {"sentences": len(texts), "missing": []}
    reads: list[Read] = []
    for name, speak in _SETS.items():
        try:
            clips = speak(texts, np.random.default_rng([seed, 1]))
        except EngineMissing as error:
            figures["missing"].append(str(error))
            clips = []
        for suffix, snr_db in (("", None), ("_10db", NOISY_DB)):
            random = np.random.default_rng([seed, 2])
            told = read_all(recogniser, [heard(c, random, snr_db) for c in clips])
            reads += told
            figures[f"wer_{name}{suffix}"] = count_of(told).error_ratio if told else None
            figures[f"exact_{name}{suffix}"] = count_of(told).exact_ratio if told else None
            if not suffix:
                figures[f"by_voice_{name}"] = _by_voice(told)
    return figures, reads


_SETS: Final[dict[str, Callable[[Sequence[str], np.random.Generator], list[SpokenClip]]]] = {
    "known_voices": lambda texts, random: by_known_voices(texts, random, 0.0),
    "known_flite": lambda texts, random: by_known_voices(texts, random, 1.0),
    "held_out_voices": by_held_out_voices,
    "unseen_engine": by_unseen_engine,
    "held_styles": lambda texts, random: by_styles(texts, random, kokoro.DEVELOPMENT),
    "judged_styles": lambda texts, random: by_styles(texts, random, kokoro.JUDGED),
}
"""Nothing is chosen by the judged styles; what is shipped is, by the held ones among others."""


def _by_voice(reads: Sequence[Read]) -> dict[str, float]:
    """Return error rates by who speaks: of eSpeak by variant, of others by voice."""
    voices: dict[str, list[Read]] = {}
    for one in reads:
        voices.setdefault(one.clip.voice.rpartition("+")[2], []).append(one)
    return {
        voice: round(count_of(told).error_ratio, 4)
        for voice, told in sorted(voices.items())
        if len(told) > 4
    }


def other_sounds(
    recogniser: Recogniser, least_confidence: float, count: int, seed: int
) -> dict[str, Any]:
    """Return which share of other talk, other languages and noise would be taken for sure words."""
    random = np.random.default_rng([seed, 3])
    sets = {
        "talk": [heard(c, random) for c in by_held_out_voices(sentences("talk")[:count], random)],
        "foreign": [heard(c, random) for c in by_foreigners(count, random)],
        "noise": noises_alone(count, random),
    }
    figures: dict[str, Any] = {}
    for name, clips in sets.items():
        reads = read_all(recogniser, clips)
        sure = [one for one in reads if _sureness(recogniser, one) >= least_confidence]
        figures[f"{name}_unsure_ratio"] = 1.0 - len(sure) / len(reads)
        if name == "talk":
            figures["wer_talk"] = count_of(reads).error_ratio
    return figures


def sureness(
    recogniser: Recogniser, reads: Sequence[Read], least_confidence: float
) -> dict[str, float]:
    """Return whether confidence tells right readings from wrong ones."""
    scores = np.array([_sureness(recogniser, one) for one in reads])
    right = np.array([one.is_exact for one in reads])
    sure = scores >= least_confidence
    return {
        "accepted_ratio": float(sure.mean()),
        "accepted_right_ratio": float(right[sure].mean()) if sure.any() else 0.0,
        "right_accepted_ratio": float(sure[right].mean()) if right.any() else 0.0,
        "confidence_auroc": _auroc(scores, right),
    }


def _sureness(recogniser: Recogniser, one: Read) -> float:
    return confidence(one.reading, recogniser.declared.calibration)


def _auroc(scores: "np.ndarray[Any, Any]", right: "np.ndarray[Any, Any]") -> float:
    """Return how probably a right reading scores above a wrong one."""
    good, bad = scores[right], scores[~right]
    if not len(good) or not len(bad):
        return 1.0
    above = (good[:, None] > bad[None, :]).mean() + 0.5 * (good[:, None] == bad[None, :]).mean()
    return float(above)


def speed(reads: Sequence[Read]) -> dict[str, float]:
    """Return what reading costs: CPU time per time of sound, and how long one waits for it."""
    took_s = np.array([one.reading.took_s for one in reads])
    lasted_s = np.array([one.clip.duration_s for one in reads])
    cpu_s = sum(one.cpu_s for one in reads)
    return {
        "real_time_factor": float(cpu_s / lasted_s.sum()),
        "wall_real_time_factor": float(took_s.sum() / lasted_s.sum()),
        "read_p50_s": float(np.median(took_s)),
        "read_p95_s": float(np.quantile(took_s, 0.95)),
        "phrase_median_s": float(np.median(lasted_s)),
    }
