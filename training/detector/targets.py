"""Turn labelled boxes into what the network's maps should say."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

STRIDE_PX = 8
CORE_RATIO = 0.25
MIN_CORE_PX, MAX_CORE_PX = 6.0, 14.0
"""Half size of the core of a box, whose cells learn it: a share of the box's, within bounds."""
Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """Hold targets of one image for each of its h x w cells.

    `names` is the class of the thing in whose core the cell lies, or -1; `ignored` is 1 where
    nothing is to be learnt but cores; `edges` (4 x h x w) are distances in pixels from the cell's
    centre to the left, top, right and bottom edge; `share` is the cell's weight in its core.
    """

    names: NDArray[np.int64]
    ignored: Floats
    edges: Floats
    share: Floats


def make_targets(rows: NDArray[np.float32], height: int, width: int) -> Targets:
    """Return the targets of an image of that size in pixels for the data set's rows of it."""
    h, w = height // STRIDE_PX, width // STRIDE_PX
    targets = Targets(
        names=np.full((h, w), -1, np.int64),
        ignored=np.zeros((h, w), np.float32),
        edges=np.ones((4, h, w), np.float32),
        share=np.zeros((h, w), np.float32),
    )
    areas = (rows[:, 4] - rows[:, 2]) * (rows[:, 5] - rows[:, 3])
    for row in rows[np.argsort(-areas)]:
        if row[6]:
            _learn(targets, int(row[1]), row[2:6])
        else:
            _pass_over(targets, row[2:6])
    return targets


def _pass_over(targets: Targets, box: Floats) -> None:
    left, top = np.floor(box[:2] / STRIDE_PX).astype(int)
    right, bottom = np.ceil(box[2:] / STRIDE_PX).astype(int)
    targets.ignored[top:bottom, left:right] = 1.0


def _learn(targets: Targets, class_index: int, box: Floats) -> None:
    """Write one box over what larger ones wrote before: a cell can tell of one box alone."""
    h, w = targets.share.shape
    top, bottom = _core(box[1], box[3], h)
    left, right = _core(box[0], box[2], w)
    core = np.s_[top:bottom, left:right]
    x = (np.arange(left, right) + 0.5) * STRIDE_PX
    y = (np.arange(top, bottom) + 0.5)[:, None] * STRIDE_PX
    edges = np.broadcast_arrays(x - box[0], y - box[1], box[2] - x, box[3] - y)
    targets.names[core] = class_index
    targets.edges[:, *core] = np.stack(edges)
    targets.share[core] = ((bottom - top) * (right - left)) ** -0.5


def _core(low: float, high: float, cells: int) -> tuple[int, int]:
    """Return the first cell in the core of a span in pixels, and that after the last."""
    middle, reach = (low + high) / 2, CORE_RATIO * (high - low)
    reach = min(max(reach, MIN_CORE_PX), MAX_CORE_PX)
    first = round((middle - reach) / STRIDE_PX)
    after = round((middle + reach) / STRIDE_PX)
    return max(0, first), min(cells, max(after, first + 1))
