"""Hold what a recogniser read in a phrase, what may have been said instead, and how sure it is."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import Final

from vla_deploy.inference.manifest import Calibration

UNCALIBRATED: Final = Calibration(bias=3.0, log_probability=4.0, no_speech=-2.0, compression=-3.0)
"""For weights that nobody has measured: a mean log-probability of -0.75 is about half sure."""
_LEAST_ODDS: Final = 0.02
"""Of what may have been said instead: what is less likely is none of it."""
_PLAIN_COMPRESSION: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Transcript:
    """Hold what a model read in a phrase, and what speaks for it.

    `log_probability` is the mean of its tokens, `no_speech` how probably nobody spoke;
    `compression` is how much shorter zlib makes the text. `language` is the one that was spoken,
    as far as the model knows several. `others` is what may have been said instead, the likeliest
    first, each with its probability over that of `text`; `confidence` how probably the words are
    right. A phrase `is_foreign` that was spoken in a language which nobody declared.
    """

    text: str
    log_probability: float
    no_speech: float
    compression: float
    language: str
    others: tuple[tuple[str, float], ...] = ()
    is_foreign: bool = False
    confidence: float = 0.0
    took_s: float = 0.0


def others_of(readings: Sequence[tuple[str, float]]) -> tuple[tuple[str, float], ...]:
    """Return what else was found; `readings` have the logarithm of their probability."""
    (best, best_log), *rest = readings
    odds: dict[str, float] = {}
    for text, log_probability in rest:
        if text and text != best:
            odds.setdefault(text, math.exp(min(0.0, log_probability - best_log)))
    ranked = sorted(odds.items(), key=lambda one: -one[1])
    return tuple((text, round(one, 4)) for text, one in ranked if one >= _LEAST_ODDS)


def evidence_of(transcript: Transcript) -> tuple[float, float, float, float]:
    """Return what a calibration's weights are for, in their order."""
    repeats = max(0.0, transcript.compression - _PLAIN_COMPRESSION)
    return 1.0, transcript.log_probability, transcript.no_speech, repeats


def confidence(transcript: Transcript, calibration: Calibration | None) -> float:
    """Return how probably the words are right, from 0 to 1; 0 where there are none."""
    if not transcript.text:
        return 0.0
    weights = astuple(calibration or UNCALIBRATED)
    evidence = sum(
        weight * value for weight, value in zip(weights, evidence_of(transcript), strict=True)
    )
    return 1.0 / (1.0 + math.exp(-min(max(evidence, -50.0), 50.0)))
