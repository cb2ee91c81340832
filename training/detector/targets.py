"""Turn labelled boxes into what the network's maps should say."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.detector.classes import CLASSES

STRIDE_PX = 4
SPREAD_RATIO = 0.54
"""Share of a box, in each direction, over which its cells learn."""
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
    x, y = (float(box[0] + box[2]) / 2 / STRIDE_PX, float(box[1] + box[3]) / 2 / STRIDE_PX)
    column, row = min(int(x), w - 1), min(int(y), h - 1)
    reach = [int((box[2 + k] - box[k]) / STRIDE_PX / 2 * SPREAD_RATIO) for k in (0, 1)]
    columns = np.arange(max(0, column - reach[0]), min(w, column + reach[0] + 1))
    rows = np.arange(max(0, row - reach[1]), min(h, row + reach[1] + 1))
    bell = np.outer(_bell(rows - row, reach[1]), _bell(columns - column, reach[0]))
    area = np.ix_(rows, columns)
    heat = targets.heat[class_index]
    heat[area] = np.maximum(heat[area], bell)
    centre_x, centre_y = (columns + 0.5) * STRIDE_PX, (rows + 0.5)[:, None] * STRIDE_PX
    for k, distance in enumerate(
        (centre_x - box[0], centre_y - box[1], box[2] - centre_x, box[3] - centre_y)
    ):
        targets.edges[k][area] = np.broadcast_to(distance, bell.shape).clip(0.5)
    size = max(float((box[2] - box[0]) * (box[3] - box[1])), 1.0)
    targets.share[area] = bell * (math.log(size) / bell.sum())


def _bell(offsets: NDArray[np.int_], reach: int) -> Floats:
    sigma = (2 * reach + 1) / 6
    return np.asarray(np.exp(-(offsets**2) / (2 * sigma**2)), np.float32)
