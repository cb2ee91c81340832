"""Make batches: vary the images, cut pieces out of them, and draw their targets."""

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from training.detector.dataset import Shard
from training.detector.targets import make_targets

Image = NDArray[np.uint8]
Rows = NDArray[np.float32]
MIN_LEFT_RATIO = 0.6
"""A thing of which a cut leaves less is passed over."""
AT_THING_CHANCE = 0.85
AS_DRAWN_CHANCE = 0.4
SCALES = (0.8, 1.25)
"""How much pieces are grown or shrunk."""


def make_batch(
    shard: Shard,
    picks: NDArray[np.int_],
    random: np.random.Generator,
    piece_px: tuple[int, int] | None,
) -> tuple[Tensor, list[Tensor]]:
    """Return images (N x 3 x H x W, bytes) and targets; whole images where no size is given."""
    images, targets = [], []
    for pick in picks:
        first, last = np.searchsorted(shard.labels[:, 0], [pick, pick + 1])
        image, rows = shard.images[pick], shard.labels[first:last].copy()
        if piece_px is not None:
            image, rows = _cut(image, rows, random, piece_px)
        image, rows = _vary(image, rows, random)
        images.append(image)
        made = make_targets(rows, *image.shape[:2])
        targets.append((made.names, made.ignored, made.edges, made.share))
    stacked = [torch.from_numpy(np.stack(maps)) for maps in zip(*targets, strict=True)]
    return torch.from_numpy(np.stack(images)).permute(0, 3, 1, 2), stacked


def _cut(
    image: Image, rows: Rows, random: np.random.Generator, piece_px: tuple[int, int]
) -> tuple[Image, Rows]:
    """Cut out a piece, mostly one that has a thing near its middle, and mostly scale it a bit."""
    scale = 1.0 if random.random() < AS_DRAWN_CHANCE else float(random.uniform(*SCALES))
    high, wide = (round(side / scale) for side in piece_px)
    room = np.array([image.shape[1] - wide, image.shape[0] - high])
    corner = random.integers(0, room + 1)
    judged = rows[rows[:, 6] > 0]
    if len(judged) and random.random() < AT_THING_CHANCE:
        box = judged[int(random.integers(len(judged)))]
        middle = np.array([box[2] + box[4], box[3] + box[5]]) / 2
        off = random.uniform(-0.3, 0.3, 2) * (wide, high)
        corner = (middle - np.array([wide, high]) / 2 + off).clip(0, room).astype(int)
    x, y = (int(value) for value in corner)
    piece, rows = image[y : y + high, x : x + wide], _cut_rows(rows, x, y, wide, high)
    rows[:, 2:6] *= np.array([piece_px[1] / wide, piece_px[0] / high] * 2)
    return np.asarray(cv2.resize(piece, piece_px[::-1]), np.uint8), rows


def _cut_rows(rows: Rows, x: int, y: int, wide: int, high: int) -> Rows:
    before = (rows[:, 4] - rows[:, 2]) * (rows[:, 5] - rows[:, 3])
    rows[:, [2, 4]] = (rows[:, [2, 4]] - x).clip(0, wide)
    rows[:, [3, 5]] = (rows[:, [3, 5]] - y).clip(0, high)
    after = (rows[:, 4] - rows[:, 2]) * (rows[:, 5] - rows[:, 3])
    rows[:, 6] *= after >= MIN_LEFT_RATIO * before
    return np.asarray(rows[after > 0])


def _vary(image: Image, rows: Rows, random: np.random.Generator) -> tuple[Image, Rows]:
    """Mirror half of the images; change the gain of each channel a bit."""
    if random.random() < 0.5:
        image = image[:, ::-1]
        rows[:, [2, 4]] = image.shape[1] - rows[:, [4, 2]]
    gain = random.uniform(0.75, 1.2) * random.uniform(0.9, 1.1, 3)
    table = (np.arange(256)[:, None] * gain).clip(0, 255).astype(np.uint8)
    return np.stack([table[image[..., k], k] for k in range(3)], axis=-1), rows
