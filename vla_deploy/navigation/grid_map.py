"""Load an occupancy map in the format of ROS map_server: a YAML file beside a grey image."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.errors import MapInvalid

REQUIRED_KEYS = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
# Black crosses the plane of the lidar; dark grey stands above or below it, like a table top.
LIDAR_THRESH = 0.95


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GridMap:
    """Hold a map of square cells; row 0 is the southernmost, as y grows with the row.

    `origin_m` is the map-frame position of the outer corner of cell (0, 0). `blocked` marks where
    the robot must not go: occupied and unknown cells. `seen_by_lidar` marks what crosses the
    lidar's plane, for localisation; None means all that is blocked.
    """

    resolution_m: float
    origin_m: tuple[float, float]
    blocked: NDArray[np.bool_]
    seen_by_lidar: NDArray[np.bool_] | None = None

    def world_to_cell(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Return row and column of the cell that holds a point; it may lie off the map."""
        column = math.floor((x_m - self.origin_m[0]) / self.resolution_m)
        row = math.floor((y_m - self.origin_m[1]) / self.resolution_m)
        return row, column

    def cell_to_world(self, row: int, column: int) -> tuple[float, float]:
        """Return x and y of a cell's centre."""
        x_m = self.origin_m[0] + (column + 0.5) * self.resolution_m
        y_m = self.origin_m[1] + (row + 0.5) * self.resolution_m
        return x_m, y_m


def load_map(yaml_path: Path) -> GridMap:
    """Read a map.

    Raises:
        MapInvalid: a file is missing or not readable, or a key is missing or out of range.
    """
    entries = _read_entries(yaml_path)
    missing = [key for key in REQUIRED_KEYS if key not in entries]
    if missing:
        raise MapInvalid(f"{yaml_path}: missing {', '.join(missing)}; see ROS map_server's format")
    origin, resolution_m = entries["origin"], entries["resolution"]
    if not (isinstance(origin, list) and len(origin) == 3 and origin[2] == 0.0):
        raise MapInvalid(f"{yaml_path}: origin: expected [x, y, 0.0], got {origin}")
    if not (isinstance(resolution_m, (int, float)) and resolution_m > 0.0):
        raise MapInvalid(f"{yaml_path}: resolution: expected metres above 0, got {resolution_m}")
    image_path = yaml_path.parent / str(entries["image"])
    image = cv2.imread(str(image_path), cv2.IMREAD_GRAYSCALE) if image_path.is_file() else None
    if image is None:
        raise MapInvalid(f"{image_path}: expected a grey image, found none or an unreadable one")
    image = np.flipud(image)
    dark = image / 255.0 if entries.get("negate") else (255 - image) / 255.0
    return GridMap(
        resolution_m=float(resolution_m),
        origin_m=(float(origin[0]), float(origin[1])),
        blocked=~(dark < float(str(entries["free_thresh"]))),
        seen_by_lidar=dark > max(LIDAR_THRESH, float(str(entries["occupied_thresh"]))),
    )


def _read_entries(path: Path) -> dict[str, object]:
    """Read the one level of `key: value` lines that map files consist of."""
    try:
        lines = path.read_text().splitlines()
    except OSError as error:
        raise MapInvalid(f"{path}: cannot read the map: {error.strerror}") from error
    entries: dict[str, object] = {}
    for number, line in enumerate(lines, start=1):
        text = line.split("#", 1)[0].strip()
        if not text or text == "---":
            continue
        key, colon, value = text.partition(":")
        if not colon:
            raise MapInvalid(f"{path}:{number}: expected `key: value`, got {text!r}")
        entries[key.strip()] = _value(value.strip())
    return entries


def _value(text: str) -> object:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text.strip("'\"")
