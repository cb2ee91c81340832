"""Tell what a map file holds, and whether a robot can live on it."""

from typing import Any

import cv2
import numpy as np

from vla_deploy.navigation.path_planning import clearance_of
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.maps.grid_map import grid_of, with_zones
from vla_deploy.robots.maps.map_file import UNKNOWN_SHADE, MapFile


def describe(file: MapFile) -> dict[str, Any]:
    """Return size and shares of a map."""
    probability = file.probability()
    rows, columns = file.shades.shape
    return {
        "width_m": round(columns * file.resolution_m, 3),
        "height_m": round(rows * file.resolution_m, 3),
        "columns": columns,
        "rows": rows,
        "resolution_m": file.resolution_m,
        "origin_m": list(file.origin_m),
        "mode": str(file.mode),
        "known_ratio": round(float(np.mean(~np.isnan(probability))), 4),
        "occupied_ratio": round(float(np.mean(probability > file.occupied_thresh)), 4),
        "free_m2": round(
            float(np.count_nonzero(probability < file.free_thresh)) * file.resolution_m**2, 2
        ),
    }


def check_for_robot(file: MapFile, robot: RobotDescription) -> tuple[dict[str, Any], list[str]]:
    """Return the floor that the robot reaches from its start pose, and every fault."""
    grid = with_zones(grid_of(file), robot.home.zones)
    fits = clearance_of(grid) >= robot.base.footprint_radius_m
    _, parts = cv2.connectedComponents(fits.astype(np.uint8), connectivity=8)
    poses = {"the start pose": robot.start_pose} | {
        f"place {name}": place.pose for name, place in robot.places.items()
    }
    found = {name: _part(parts, grid.world_to_cell(p.x_m, p.y_m)) for name, p in poses.items()}
    home = found["the start pose"]
    reached_m2 = float(np.count_nonzero(parts == home)) * file.resolution_m**2 if home else 0.0
    faults = [
        f"{name}: the robot does not fit there at {poses[name].x_m:.2f}, {poses[name].y_m:.2f} m"
        for name, part in found.items()
        if part == 0
    ]
    faults += [
        f"{name}: no way from the start pose leads there"
        for name, part in found.items()
        if part not in (0, home)
    ]
    return {"reachable_m2": round(reached_m2, 2)}, faults


def as_characters(file: MapFile, columns: int = 100) -> str:
    """Return the map drawn for a terminal: # wall, o only the body hits, . free, blank unknown."""
    step = max(1, -(-file.shades.shape[1] // columns))
    lines = []
    for top in range(0, file.shades.shape[0], 2 * step):
        row = file.shades[top : top + 2 * step]
        blocks = [row[:, left : left + step] for left in range(0, row.shape[1], step)]
        lines.append("".join(_character(file, block) for block in blocks).rstrip())
    return "\n".join(lines)


def _part(parts: np.ndarray, cell: tuple[int, int]) -> int:
    """Return which connected part of the floor a cell is in; 0 is none."""
    row, column = cell
    inside = 0 <= row < parts.shape[0] and 0 <= column < parts.shape[1]
    return int(parts[row, column]) if inside else 0


def _character(file: MapFile, block: np.ndarray) -> str:
    cut = MapFile(
        shades=block,
        resolution_m=file.resolution_m,
        origin_m=file.origin_m,
        mode=file.mode,
        negate=file.negate,
        occupied_thresh=file.occupied_thresh,
        free_thresh=file.free_thresh,
    )
    probability = cut.probability()
    if (probability > file.occupied_thresh).any():
        darkest = int(block.max() if file.negate else block.min())
        return "#" if darkest in (0, 255) else "o"
    if np.isnan(probability).all() or (block == UNKNOWN_SHADE).all():
        return " "
    return "."
