"""Learn from readings how sure a recogniser's words are: a logistic function of what it tells."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from training.speech.judging import Read, read_all
from training.speech.trials import (
    by_foreigners,
    by_known_voices,
    drawn_sentences,
    heard,
    noises_alone,
)
from vla_deploy.inference.manifest import Calibration
from vla_deploy.speech.recogniser import Recogniser

_PLAIN_COMPRESSION: Final = 2.0
_STEPS: Final = 4000
_RATE: Final = 0.05
_PULL: Final = 1e-3
"""Towards zero: without it a weight that no reading speaks against grows without end."""


def readings(recogniser: Recogniser, count: int, seed: int) -> list[Read]:
    """Read sentences that were drawn for this, by voices of training, clean to very noisy."""
    random = np.random.default_rng([seed, 4])
    clips = by_known_voices(drawn_sentences(count, random), random, 0.4)
    noisy = [heard(clip, random, float(random.uniform(-5.0, 25.0))) for clip in clips]
    others = [heard(clip, random) for clip in by_foreigners(count // 6, random)]
    return read_all(recogniser, [*noisy, *others, *noises_alone(count // 10, random)])


def fit(reads: Sequence[Read]) -> Calibration:
    """Return the weights under which right and wrong readings are most probable."""
    with_words = [one for one in reads if one.reading.text]
    evidence = np.array(
        [
            (
                1.0,
                one.reading.log_probability,
                one.reading.no_speech,
                max(0.0, one.reading.compression - _PLAIN_COMPRESSION),
            )
            for one in with_words
        ]
    )
    right = np.array([one.is_exact for one in with_words], dtype=float)
    weights = np.array([3.0, 4.0, -2.0, -3.0])
    for _ in range(_STEPS):
        told = 1.0 / (1.0 + np.exp(-np.clip(evidence @ weights, -50.0, 50.0)))
        slope = evidence.T @ (told - right) / len(right) + _PULL * weights
        weights -= _RATE * slope / np.maximum(np.abs(evidence).max(axis=0), 0.2)
    bias, log_probability, no_speech, compression = (round(float(w), 4) for w in weights)
    return Calibration(
        bias=bias,
        log_probability=log_probability,
        no_speech=min(no_speech, 0.0),
        compression=min(compression, 0.0),
    )
