"""Hold arrays of cells that grow as far as the robot has seen."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.floor_pose import Points

Cells = NDArray[np.float32]

GROWTH_M: Final = 4.0
LARGEST_M: Final = 250.0


class CellWindow:
    """Keep several layers over one rectangle; each begins with its own value.

    Cell (0, 0) has its lower left corner at `corner` whole cells from the frame's origin.
    """

    def __init__(self, resolution_m: float, layers: Mapping[str, float]) -> None:
        self.resolution_m = resolution_m
        self.corner = (0, 0)
        self._empty = dict(layers)
        self.layers: dict[str, Cells] = {
            name: np.full((0, 0), value, dtype=np.float32) for name, value in layers.items()
        }

    @property
    def shape(self) -> tuple[int, int]:
        """Return rows and columns."""
        rows, columns = next(iter(self.layers.values())).shape
        return rows, columns

    @property
    def origin_m(self) -> tuple[float, float]:
        """Return where cell (0, 0) has its lower left corner."""
        return self.corner[0] * self.resolution_m, self.corner[1] * self.resolution_m

    def cover(self, points: Points) -> None:
        """Grow so that (n, 2) points lie inside, and some way around them.

        Raises:
            MapInvalid: the map would become larger than any flat: the poses must be wrong.
        """
        if not len(points):
            return
        rows, columns = self.shape
        low = np.floor(points.min(axis=0) / self.resolution_m).astype(int) - self.corner
        high = np.floor(points.max(axis=0) / self.resolution_m).astype(int) - self.corner + 1
        if rows and low.min() >= 0 and high[0] <= columns and high[1] <= rows:
            return
        spare = math.ceil(GROWTH_M / self.resolution_m)
        left, below = (0 if rows and edge >= 0 else int(-edge) + spare for edge in low)
        right = 0 if rows and high[0] <= columns else int(high[0]) - columns + spare
        above = 0 if rows and high[1] <= rows else int(high[1]) - rows + spare
        size_m = max(rows + below + above, columns + left + right) * self.resolution_m
        if size_m > LARGEST_M:
            raise MapInvalid(
                f"the map would grow to {size_m:.0f} m, the limit is {LARGEST_M:g} m; "
                "the poses must be wrong: record it anew, slower"
            )
        self.corner = (self.corner[0] - left, self.corner[1] - below)
        for name, cells in self.layers.items():
            pad = ((below, above), (left, right))
            self.layers[name] = np.pad(cells, pad, constant_values=self._empty[name])

    def flat_index(self, points: Points) -> NDArray[np.intp]:
        """Return the index of each point's cell in the flattened layers; all must be covered."""
        at = np.floor(points / self.resolution_m).astype(np.intp) - self.corner
        index: NDArray[np.intp] = at[:, 1] * self.shape[1] + at[:, 0]
        return index
