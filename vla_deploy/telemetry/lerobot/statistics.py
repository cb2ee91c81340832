"""Compute the statistics of a dataset's features: of one episode, and of all by their counts.

Which figures there are, and that quantiles of all are the mean of those of the episodes:
lerobot v0.6.1, datasets/compute_stats.py. Image values are in 0..1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
QUANTILES: Final[Mapping[str, float]] = {
    "q01": 0.01,
    "q10": 0.10,
    "q50": 0.50,
    "q90": 0.90,
    "q99": 0.99,
}
_LEVELS: Final = 256
_CHANNELS: Final = 3
_SHORT_SIDE_PX: Final = 150
"""Larger images are thinned out to about this size; it is statistics of a picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureStatistics:
    """Hold the figures of one feature, an array of its dimensions each, over `count` frames."""

    count: int
    figures: Mapping[str, Floats]

    def document(self) -> dict[str, Any]:
        """Return them as lists."""
        return {**{name: one.tolist() for name, one in self.figures.items()}, "count": [self.count]}


def of_values(values: NDArray[Any]) -> FeatureStatistics:
    """Return the statistics of an array of frame by dimension."""
    numbers = values.astype(np.float64).reshape(len(values), -1)
    quantiles = np.quantile(numbers, list(QUANTILES.values()), axis=0)
    return FeatureStatistics(
        count=len(numbers),
        figures={
            "min": numbers.min(axis=0),
            "max": numbers.max(axis=0),
            "mean": numbers.mean(axis=0),
            "std": numbers.std(axis=0),
            **dict(zip(QUANTILES, quantiles, strict=True)),
        },
    )


class ImageStatistics:
    """Count the levels of the three channels of an episode's images, whatever their number."""

    def __init__(self) -> None:
        self._counts = np.zeros((_CHANNELS, _LEVELS), dtype=np.int64)
        self._images = 0

    def add(self, rgb: NDArray[np.uint8]) -> None:
        """Take in an image of height by width by channel."""
        step = max(1, min(rgb.shape[:2]) // _SHORT_SIDE_PX)
        thinned = rgb[::step, ::step]
        for channel in range(_CHANNELS):
            levels = np.bincount(thinned[..., channel].ravel(), minlength=_LEVELS)
            self._counts[channel] += levels
        self._images += 1

    def result(self) -> FeatureStatistics:
        """Return the statistics of all images taken in, of shape 3 x 1 x 1."""
        levels = np.arange(_LEVELS) / (_LEVELS - 1)
        share = self._counts / self._counts.sum(axis=1, keepdims=True)
        mean = share @ levels
        variance = share @ levels**2 - mean**2
        reached = np.cumsum(share, axis=1)
        figures = {
            "min": levels[(self._counts > 0).argmax(axis=1)],
            "max": levels[_LEVELS - 1 - (self._counts[:, ::-1] > 0).argmax(axis=1)],
            "mean": mean,
            "std": np.sqrt(np.maximum(variance, 0.0)),
        }
        for name, quantile in QUANTILES.items():
            figures[name] = levels[(reached >= quantile - 1e-12).argmax(axis=1)]
        shaped = {name: one.reshape(_CHANNELS, 1, 1) for name, one in figures.items()}
        return FeatureStatistics(count=self._images, figures=shaped)


def of_all(parts: Sequence[FeatureStatistics]) -> FeatureStatistics:
    """Return the statistics of all episodes from those of each."""
    counts = np.array([part.count for part in parts], dtype=np.float64)
    share = counts / counts.sum()

    def stacked(name: str) -> Floats:
        return np.stack([part.figures[name] for part in parts])

    def mean_of(values: Floats) -> Floats:
        return np.tensordot(share, values, axes=1)

    mean = mean_of(stacked("mean"))
    variance = mean_of(stacked("std") ** 2 + (stacked("mean") - mean) ** 2)
    return FeatureStatistics(
        count=int(counts.sum()),
        figures={
            "min": stacked("min").min(axis=0),
            "max": stacked("max").max(axis=0),
            "mean": mean,
            "std": np.sqrt(variance),
            **{name: mean_of(stacked(name)) for name in QUANTILES},
        },
    )
