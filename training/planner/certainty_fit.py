"""Fit how sure answers are: a logistic function of what can be seen of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.manifest import Certainty

_NAMES: Final = ("least", "mean", "strange")
_STEPS: Final = 200
_RIDGE: Final = 0.01
RIGHT_UNASKED: Final = 0.97
DECLINE_BELOW: Final = 0.25


@dataclass(frozen=True, slots=True)
class Judged:
    """Hold what was seen of one answer, and whether it was right."""

    features: Mapping[str, float]
    is_right: bool


def fit(judged: Sequence[Judged]) -> Certainty:
    """Return the weights that make what was judged likeliest: Newton's method, a small ridge."""
    seen = np.array([[1.0, *(one.features[name] for name in _NAMES)] for one in judged])
    right = np.array([one.is_right for one in judged], dtype=float)
    weights = np.zeros(seen.shape[1])
    for _ in range(_STEPS):
        told = 1.0 / (1.0 + np.exp(-np.clip(seen @ weights, -30.0, 30.0)))
        slope = seen.T @ (told - right) + _RIDGE * weights
        bend = (seen * (told * (1.0 - told))[:, None]).T @ seen + _RIDGE * np.eye(len(weights))
        step = np.linalg.solve(bend, slope)
        weights -= step
        if np.abs(step).max() < 1e-8:
            break
    bias, least, mean, strange = (round(float(one), 4) for one in weights)
    sure = 1.0 / (1.0 + np.exp(-np.clip(seen @ weights, -30.0, 30.0)))
    return Certainty(
        bias=bias,
        least=least,
        mean=mean,
        strange=strange,
        read_back_below=_bound(sure, right),
        decline_below=DECLINE_BELOW,
    )


def _bound(sure: NDArray[np.float64], right: NDArray[np.float64]) -> float:
    """Return the least confidence from which upwards answers are right as often as they must be."""
    order = np.argsort(-sure)
    shares = np.cumsum(right[order]) / np.arange(1, len(order) + 1)
    enough = np.nonzero(shares >= RIGHT_UNASKED)[0]
    return round(float(sure[order][enough[-1]]), 3) if len(enough) else 1.0
