"""Hold what a recogniser read in a phrase, and what may have been said instead."""

import math
from dataclasses import dataclass
from typing import Final

_LEAST_ODDS: Final = 0.02
"""Of what may have been said instead: what is less likely is none of it."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """Hold what may have been said instead; `odds` is its probability over the reading's own."""

    text: str
    odds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Hold what a model read in a phrase, and what speaks for it.

    `stop_surety` is how surely a stop word is in it by the ear for them, None without one, and
    `stop_odds` how likely one was said instead of a word of the text, as far as that was asked.
    `log_probability` is the mean of its tokens, `no_speech` how probably nobody spoke;
    `compression` is how much shorter zlib makes the text. `language` is the one that was spoken,
    as far as the model knows several. `others` is what may have been said instead, the likeliest
    first.
    """

    text: str
    log_probability: float
    no_speech: float
    compression: float
    language: str
    duration_s: float
    took_s: float
    others: tuple[Alternative, ...] = ()
    stop_surety: float | None = None
    stop_odds: float | None = None


def others_of(windows: list[list[tuple[str, float]]]) -> tuple[Alternative, ...]:
    """Return what else was found in a phrase; of several windows of sound nobody can tell."""
    if len(windows) != 1:
        return ()
    (best, best_log), *rest = windows[0]
    odds: dict[str, float] = {}
    for text, log_probability in rest:
        if text and text != best:
            odds.setdefault(text, math.exp(min(0.0, log_probability - best_log)))
    ranked = sorted(odds.items(), key=lambda one: -one[1])
    return tuple(Alternative(text, round(one, 4)) for text, one in ranked if one >= _LEAST_ODDS)
