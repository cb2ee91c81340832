"""Compare a drawn map with the true one, cell by cell where it says anything."""

from typing import Any

import numpy as np

from vla_deploy.robots.maps.grid_map import LIDAR_THRESH
from vla_deploy.robots.maps.map_file import UNKNOWN_SHADE, MapFile, Shades


def compare_maps(drawn: MapFile, truth: MapFile) -> dict[str, Any]:
    """Return the share of observed cells that are right about what the lidar's plane meets.

    What only the body would hit counts as free here: a lidar alone cannot see it.

    Raises:
        ValueError: the maps' cells differ in size.
    """
    if abs(drawn.resolution_m - truth.resolution_m) > 1e-9:
        raise ValueError(f"cells of {drawn.resolution_m} m against {truth.resolution_m} m")
    laid = _laid_over(drawn, truth)
    observed = laid != UNKNOWN_SHADE
    occupied, truly = _is_black(laid), _is_black(truth.shades)
    right = (occupied == truly) & observed
    return {
        "observed_cells": int(observed.sum()),
        "right_ratio": round(float(right.sum() / max(1, observed.sum())), 4),
        "wrongly_occupied_cells": int((occupied & ~truly & observed).sum()),
        "missed_cells": int((~occupied & truly & observed).sum()),
    }


def _is_black(shades: Shades) -> np.ndarray:
    return np.asarray(shades < 255 * (1.0 - LIDAR_THRESH))


def _laid_over(drawn: MapFile, truth: MapFile) -> Shades:
    """Return the drawn map on the true one's cells."""
    laid: Shades = np.full(truth.shades.shape, UNKNOWN_SHADE, dtype=np.uint8)
    column = round((drawn.origin_m[0] - truth.origin_m[0]) / truth.resolution_m)
    row = round((drawn.origin_m[1] - truth.origin_m[1]) / truth.resolution_m)
    south_first = np.flipud(drawn.shades)
    known_rows, known_columns = np.nonzero(south_first != UNKNOWN_SHADE)
    rows, columns = known_rows + row, known_columns + column
    inside = (rows >= 0) & (rows < laid.shape[0]) & (columns >= 0) & (columns < laid.shape[1])
    cells = south_first[known_rows[inside], known_columns[inside]]
    laid[rows[inside], columns[inside]] = cells
    return np.flipud(laid)
