"""Learn the colour of a table from an image in which it is what is seen most."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.perception.geometry.cloud import Floats, Mask

# A shadow changes the lightness (0..100) more than the colour.
LIGHTNESS_WEIGHT: Final = 0.5
BIN_LEVELS: Final = 8.0
SEED_LEVELS: Final = 20.0
"""From the commonest colour: the table in the light and in the shade."""
LEAST_LIMIT, MOST_LIMIT = 8.0, 20.0
SIGMAS: Final = 4.0
_SIGMA_OF_MEDIAN: Final = 1.0 / 1.1774
"""The deviation of each of two like channels over the median distance (Rayleigh)."""
ROUNDS: Final = 3
SAMPLES: Final = 4000
SIZES_KEPT: Final = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TableColour:
    """Hold the table's colour, which changes over the image as the light does.

    `weights` (6, 3) give Lab by a quadratic of the place in the image; what is further from it than
    `limit` is not table. `ratio` is the share of the learned pixels that are.
    """

    weights: Floats
    limit: float
    ratio: float

    @classmethod
    def of(cls, lab: Floats, where: Mask) -> "TableColour":
        """Learn from some pixels of an image by `to_lab`; with none of them the ratio is 0."""
        places = np.flatnonzero(where)
        if not places.size:
            return cls(weights=np.zeros((6, 3), np.float32), limit=0.0, ratio=0.0)
        places = places[:: max(1, places.size // SAMPLES)]
        colours = lab.reshape(-1, 3)[places]
        terms = _terms(*where.shape)[places]
        limit = SEED_LEVELS
        near = np.linalg.norm(colours - _commonest(colours), axis=1) <= limit
        weights = np.zeros((6, 3), np.float32)
        for _ in range(ROUNDS):
            known = terms[near].astype(np.float64)
            weights = np.linalg.lstsq(known.T @ known, known.T @ colours[near], rcond=None)[0]
            weights = weights.astype(np.float32)
            off = np.linalg.norm(colours - terms @ weights, axis=1)
            sigma = _SIGMA_OF_MEDIAN * float(np.median(off[near]))
            limit = float(np.clip(SIGMAS * sigma, LEAST_LIMIT, MOST_LIMIT))
            near = off <= limit
            if not near.any():
                break
        return cls(weights=weights, limit=limit, ratio=float(near.mean()))

    def contrast(self, lab: Floats) -> Floats:
        """Return how far each pixel of an image by `to_lab` is from the table's colour there."""
        off = lab - (_terms(*lab.shape[:2]) @ self.weights).reshape(lab.shape)
        contrast: Floats = np.sqrt(np.einsum("hwc,hwc->hw", off, off))
        return contrast


def to_lab(rgb: NDArray[np.uint8]) -> Floats:
    """Return an image in CIE Lab, lightness weighted less."""
    lab: Floats = cv2.cvtColor(rgb.astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2Lab)
    lab[..., 0] *= LIGHTNESS_WEIGHT
    return lab


def _commonest(colours: Floats) -> Floats:
    bins = np.floor(colours / BIN_LEVELS).astype(np.int64) @ (1 << 16, 1 << 8, 1)
    _, numbers, counts = np.unique(bins, return_inverse=True, return_counts=True)
    commonest: Floats = np.median(colours[numbers == int(np.argmax(counts))], axis=0)
    return commonest


@lru_cache(maxsize=SIZES_KEPT)
def _terms(height: int, width: int) -> Floats:
    """Return the terms (h * w, 6) of a quadratic over an image, from -1 to 1."""
    down, across = np.meshgrid(
        np.linspace(-1.0, 1.0, height, dtype=np.float32),
        np.linspace(-1.0, 1.0, width, dtype=np.float32),
        indexing="ij",
    )
    u, v = across.ravel(), down.ravel()
    return np.column_stack((np.ones_like(u), u, v, u * u, u * v, v * v))
