"""Tell from a depth image where things stand that the body would hit, and where floor is bare."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.floor_pose import Points

STRIDE_PX: Final = 3
NEAR_M, FAR_M = 0.25, 2.5
# Lower is floor, higher passes over the robot's head; between floor and band nothing is said.
FLOOR_M: Final = 0.02
LOWEST_M, HIGHEST_M = 0.06, 1.25
MIN_PIXELS: Final = 3
CELL_M: Final = 0.05


def depth_band(
    depth_m: NDArray[np.float32],
    rays: NDArray[np.float32],
    base_from_camera: NDArray[np.float64],
    body: NDArray[np.bool_],
) -> tuple[Points, Points]:
    """Return points of things that stand and of bare floor, (n, 2) each in the base's frame.

    `rays` (h, w, 2) is each pixel's way right and down per metre of depth; `body` marks the robot
    itself. What fewer than three of the pixels looked at show is noise.
    """
    some = (slice(None, None, STRIDE_PX), slice(None, None, STRIDE_PX))
    depth = np.nan_to_num(depth_m[some].astype(np.float64))
    rows, columns = np.nonzero((depth > NEAR_M) & (depth < FAR_M) & ~body[some])
    z = depth[rows, columns]
    x, y = rays[some][rows, columns].T * z
    points = np.column_stack((x, y, z)) @ base_from_camera[:3, :3].T + base_from_camera[:3, 3]
    height_m = points[:, 2]
    standing = points[(height_m > LOWEST_M) & (height_m < HIGHEST_M), :2]
    floor = points[np.abs(height_m) < FLOOR_M, :2]
    return _often(standing), _often(floor)


def _often(points: Points) -> Points:
    """Keep the points in whose cell several lie."""
    if not len(points):
        return points
    cells = np.floor(points / CELL_M).astype(np.int64)
    _, at, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    kept: Points = points[counts[at.ravel()] >= MIN_PIXELS]
    return kept
