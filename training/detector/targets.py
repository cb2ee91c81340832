"""Turn labelled boxes into what the network's maps should say."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.detector.classes import CLASSES

STRIDE_PX = 4
SPREAD_RATIO, MIN_SPREAD_CELLS = 0.12, 0.8
"""Standard deviation of the heat around a centre, as a share of the box, and at least."""
LEAST_HEAT, LEAST_SHARE = 0.02, 0.1
"""Heat below the first is none; cells above the second learn the box's edges."""
Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """Hold targets of one image: heat (classes x h x w, 1 at centres), where it does not count
    (`ignored`, 0 or 1), edges in pixels (4 x h x w) and each cell's share in its box (h x w).
    """

    heat: Floats
    ignored: Floats
    edges: Floats
    share: Floats


def make_targets(rows: NDArray[np.float32], height: int, width: int) -> Targets:
    """Return the targets of an image of that size in pixels for the data set's rows of it."""
    h, w = height // STRIDE_PX, width // STRIDE_PX
    targets = Targets(
        heat=np.zeros((len(CLASSES), h, w), np.float32),
        ignored=np.zeros((len(CLASSES), h, w), np.float32),
        edges=np.ones((4, h, w), np.float32),
        share=np.zeros((h, w), np.float32),
    )
    areas = (rows[:, 4] - rows[:, 2]) * (rows[:, 5] - rows[:, 3])
    for row in rows[np.argsort(-areas)]:
        if row[6]:
            _learn(targets, int(row[1]), row[2:6])
        else:
            _pass_over(targets, int(row[1]), row[2:6])
    return targets


def _pass_over(targets: Targets, class_index: int, box: Floats) -> None:
    left, top = (math.floor(value / STRIDE_PX) for value in box[:2])
    right, bottom = (math.ceil(value / STRIDE_PX) for value in box[2:])
    channels = slice(None) if class_index < 0 else class_index
    targets.ignored[channels, top:bottom, left:right] = 1.0


def _learn(targets: Targets, class_index: int, box: Floats) -> None:
    """Write one box over what larger ones wrote before."""
    h, w = targets.share.shape
    rows, columns = np.arange(h), np.arange(w)
    bell = np.outer(_bell(rows, box[1::2]), _bell(columns, box[::2]))
    targets.heat[class_index] = np.maximum(targets.heat[class_index], bell)
    x, y = (columns + 0.5) * STRIDE_PX, (rows + 0.5)[:, None] * STRIDE_PX
    distances = np.stack(
        np.broadcast_arrays(x - box[0], y - box[1], box[2] - x, box[3] - y)
    ).astype(np.float32)
    area = (bell >= LEAST_SHARE) & (distances.min(axis=0) > 0)
    if not area.any():
        return
    targets.edges[:, area] = distances[:, area].clip(0.5)
    size = max(float((box[2] - box[0]) * (box[3] - box[1])), 1.0)
    targets.share[area] = bell[area] * (math.log(size) / bell[area].sum())


def _bell(cells: NDArray[np.int_], span: Floats) -> Floats:
    """Return how near each row or column of cells is to the middle: 1 at the nearest one."""
    middle, size = float(span[0] + span[1]) / 2 / STRIDE_PX, float(span[1] - span[0]) / STRIDE_PX
    nearest = min(int(middle), len(cells) - 1)
    sigma = max(SPREAD_RATIO * size, MIN_SPREAD_CELLS)
    bell = np.exp(-((cells - nearest) ** 2) / (2 * sigma**2))
    return np.where(bell > LEAST_HEAT, bell, 0.0).astype(np.float32)
