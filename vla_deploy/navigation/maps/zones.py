"""Keep the base out of zones: they become part of what blocks the map."""

from collections.abc import Iterable

import cv2
import numpy as np

from vla_deploy.robots.description import KeepOutZone
from vla_deploy.robots.maps.grid_map import GridMap


def with_zones(grid: GridMap, zones: Iterable[KeepOutZone]) -> GridMap:
    """Return the map with every keep-out zone blocked."""
    blocked = grid.blocked.astype(np.uint8)
    for zone in zones:
        cells = [grid.world_to_cell(x_m, y_m)[::-1] for x_m, y_m in zone.polygon_m]
        cv2.fillPoly(blocked, [np.array(cells, dtype=np.int32)], 1)
    return GridMap(
        resolution_m=grid.resolution_m, origin_m=grid.origin_m, blocked=blocked.astype(bool)
    )
