"""Measure how fast a figure grows, once what fills up in the beginning is full."""

from collections.abc import Sequence
from typing import Final, TypeVar

import numpy as np

_WARM_UP_RATIO: Final = 0.25
"""Caches of libraries fill up in the first quarter; growth is judged after it."""
T = TypeVar("T")


def warm(samples: Sequence[T]) -> Sequence[T]:
    """Return the samples after the warm-up."""
    return samples[round(_WARM_UP_RATIO * len(samples)) :]


def slope(at: Sequence[float], values: Sequence[float]) -> float:
    """Return by how much the values grow with `at`, of which there are two at least."""
    line = np.polynomial.Polynomial.fit(np.array(at, float), np.array(values, float), 1)
    return float(line.convert().coef[-1])
