"""Draw surface patterns: one table of families for training, another for judging."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from training.detector.scenes.parts import Random, between

SIZE_PX = 64
Pattern = NDArray[np.float32]
Image = NDArray[np.uint8]
_Y, _X = np.mgrid[0:SIZE_PX, 0:SIZE_PX].astype(np.float32) / SIZE_PX


def _noise(random: Random) -> Pattern:
    coarse = random.random((SIZE_PX, SIZE_PX), dtype=np.float32)
    return np.asarray(cv2.GaussianBlur(coarse, (0, 0), between(random, 0.5, 4.0)), np.float32)


def _checker(random: Random) -> Pattern:
    count = int(random.integers(2, 9))
    return np.asarray((np.floor(_X * count) + np.floor(_Y * count)) % 2, np.float32)


def _stripes(random: Random) -> Pattern:
    count, share = int(random.integers(1, 9)), between(random, 0.2, 0.8)
    along = _X if random.random() < 0.5 else _Y
    return np.asarray((along * count) % 1.0 < share, np.float32)


def _gradient(random: Random) -> Pattern:
    angle = between(random, 0, 6.28)
    return np.asarray(
        0.5 + 0.5 * (np.cos(angle) * (_X - 0.5) + np.sin(angle) * (_Y - 0.5)), np.float32
    )


def _boards(random: Random) -> Pattern:
    rows = int(random.integers(3, 9))
    shade = random.random(rows, dtype=np.float32)
    grain = cv2.GaussianBlur(
        random.random((SIZE_PX, SIZE_PX), dtype=np.float32), (0, 0), sigmaX=8, sigmaY=0.7
    )
    return np.asarray(
        shade[(np.floor(_Y * rows)).astype(int)] * 0.7 + (grain - 0.5) * 2 + 0.2, np.float32
    )


def _print(random: Random) -> Pattern:
    """Return lines as of writing, with a block as of a picture."""
    page = np.zeros((SIZE_PX, SIZE_PX), np.float32)
    for row in range(6, SIZE_PX - 6, int(random.integers(5, 9))):
        page[row : row + 2, 6 : int(random.integers(20, SIZE_PX - 4))] = 1.0
    top, left = (int(value) for value in random.integers(4, 30, 2))
    page[top : top + 22, left : left + 26] = between(random, 0.3, 1.0)
    return page


def _dots(random: Random) -> Pattern:
    count, radius = int(random.integers(2, 9)), between(random, 0.15, 0.45)
    return np.asarray(np.hypot((_X * count) % 1 - 0.5, (_Y * count) % 1 - 0.5) < radius, np.float32)


def _cells(random: Random) -> Pattern:
    """Return patches around random seeds, each of one shade."""
    seeds, shade = random.random((14, 2)), random.random(14).astype(np.float32)
    far = np.hypot(_X[..., None] - seeds[:, 0], _Y[..., None] - seeds[:, 1])
    return np.asarray(shade[np.argmin(far, axis=2)], np.float32)


def _waves(random: Random) -> Pattern:
    count, bend = between(random, 2, 9), between(random, 0.05, 0.25)
    return np.asarray(
        0.5 + 0.5 * np.sin(6.28 * count * (_X + bend * np.sin(6.28 * 2 * _Y))), np.float32
    )


def _plaid(random: Random) -> Pattern:
    across, down = _stripes(random), _stripes(random).T
    return np.asarray(0.5 * across + 0.5 * down, np.float32)


def _scratches(random: Random) -> Pattern:
    page = np.zeros((SIZE_PX, SIZE_PX), np.float32)
    for _ in range(int(random.integers(5, 30))):
        start, end = (tuple(int(v) for v in random.integers(0, SIZE_PX, 2)) for _ in range(2))
        cv2.line(page, start, end, 1.0, 1)
    return page


TRAINING: tuple[Callable[[Random], Pattern], ...] = (
    _noise, _checker, _stripes, _gradient, _boards, _print
)  # fmt: skip
UNSEEN: tuple[Callable[[Random], Pattern], ...] = (_dots, _cells, _waves, _plaid, _scratches)
FAMILIES = {"train": TRAINING, "heldout": UNSEEN, "flat": TRAINING}


def draw_texture(random: Random, split: str) -> Image:
    """Return a square RGB pattern of one of the split's families, between two light colours."""
    families = FAMILIES[split]
    pattern = families[int(random.integers(len(families)))](random).clip(0, 1)[..., None]
    first, second = random.uniform(0.25, 1.0, 3), random.uniform(0.25, 1.0, 3)
    if random.random() < 0.5:
        second = (first * random.uniform(0.6, 1.1)).clip(0, 1)
    return np.asarray((first + pattern * (second - first)) * 255, np.uint8)
