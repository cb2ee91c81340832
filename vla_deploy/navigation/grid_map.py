"""Load the occupancy map of a place in the ROS format: a PGM picture and its YAML."""

import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.errors import MapInvalid

_REQUIRED = ("image", "resolution", "origin", "occupied_thresh")


@dataclass(frozen=True, slots=True, kw_only=True)
class GridMap:
    """Hold which cells of the floor are not free; row 0 is the lowest y, column 0 the lowest x."""

    resolution_m: float
    origin_m: tuple[float, float]
    blocked: NDArray[np.bool_]

    def world_to_cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Return (row, column) of a point of the map frame; it may lie off the map."""
        row = math.floor((y_m - self.origin_m[1]) / self.resolution_m)
        return row, math.floor((x_m - self.origin_m[0]) / self.resolution_m)

    def cell_to_world(self, row: int, column: int) -> tuple[float, float]:
        """Return the centre of a cell in the map frame."""
        x_m = self.origin_m[0] + (column + 0.5) * self.resolution_m
        return x_m, self.origin_m[1] + (row + 0.5) * self.resolution_m


def load_map(path: Path) -> GridMap:
    """Load a map by its YAML file.

    Raises:
        MapInvalid: a file is missing, a key is missing or wrong, or the picture cannot be read.
    """
    keys = _read_yaml(path)
    missing = [key for key in _REQUIRED if key not in keys]
    if missing:
        raise MapInvalid(f"{path}: missing {', '.join(missing)}; a ROS map has {_REQUIRED}")
    try:
        resolution_m = float(keys["resolution"])
        occupied = float(keys["occupied_thresh"])
        origin = [float(number) for number in keys["origin"].strip("[] ").split(",")]
    except ValueError as error:
        raise MapInvalid(f"{path}: expected numbers, got {error}") from error
    if resolution_m <= 0 or len(origin) < 2:
        raise MapInvalid(f"{path}: resolution must be positive and origin [x, y, yaw]")
    picture = cv2.imread(str(path.parent / keys["image"]), cv2.IMREAD_GRAYSCALE)
    if picture is None:
        raise MapInvalid(f"{path}: cannot read the picture {path.parent / keys['image']}")
    darkness = 1.0 - np.flipud(picture).astype(np.float64) / 255.0
    return GridMap(
        resolution_m=resolution_m, origin_m=(origin[0], origin[1]), blocked=darkness > occupied
    )


def _read_yaml(path: Path) -> dict[str, str]:
    """Read the flat `key: value` lines that a map's YAML consists of."""
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise MapInvalid(f"{path}: cannot read the map: {error.strerror}") from error
    pairs = (line.split("#")[0].split(":", 1) for line in lines if ":" in line.split("#")[0])
    return {key.strip(): value.strip().strip("\"'") for key, value in pairs}
