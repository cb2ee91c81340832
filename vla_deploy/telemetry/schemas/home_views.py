"""Draw what stays as it is: the home's map, and the camera's lens."""

import base64
from typing import Final

import numpy as np

from vla_deploy.navigation.maps.grid_map import load_map
from vla_deploy.robots import RobotDescription
from vla_deploy.telemetry.schemas.geometry import CAMERA, MAP, Json, floor_pose_json, time_json

_UINT8: Final = 1  # foxglove.NumericType
_FREE: Final = (235, 235, 235, 255)
_BLOCKED: Final = (110, 110, 110, 255)
_SEEN_BY_LIDAR: Final = (30, 30, 30, 255)
# By whether there are more than five coefficients: the model's name, and how many it has.
_DISTORTION: Final = (("plumb_bob", 5), ("rational_polynomial", 8))


def home_map(robot: RobotDescription, stamp_ns: int) -> Json:
    """Return the map as coloured cells: black crosses the lidar's plane, grey is blocked.

    Raises:
        MapInvalid: the robot's map cannot be read.
    """
    grid = load_map(robot.home.map_path)
    rows, columns = grid.blocked.shape
    cells = np.empty((rows, columns, 4), dtype=np.uint8)
    cells[...] = _FREE
    cells[grid.blocked] = _BLOCKED
    if grid.seen_by_lidar is not None:
        cells[grid.seen_by_lidar] = _SEEN_BY_LIDAR
    fields = [
        {"name": name, "offset": place, "type": _UINT8}
        for place, name in enumerate(("red", "green", "blue", "alpha"))
    ]
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": MAP,
        "pose": floor_pose_json(*grid.origin_m, 0.0),
        "column_count": columns,
        "cell_size": {"x": grid.resolution_m, "y": grid.resolution_m},
        "row_stride": 4 * columns,
        "cell_stride": 4,
        "fields": fields,
        "data": base64.b64encode(cells.tobytes()).decode(),
    }


def lens(robot: RobotDescription, stamp_ns: int) -> Json:
    """Return the camera's lens, as calibrated or as the robot file opens it."""
    seen = robot.camera.intrinsics
    model, count = _DISTORTION[len(seen.distortion) > 5]
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": CAMERA,
        "width": seen.width,
        "height": seen.height,
        "distortion_model": model if seen.distortion else "",
        "D": [*seen.distortion, *[0.0] * (count - len(seen.distortion))] if seen.distortion else [],
        "K": [seen.fx, 0.0, seen.cx, 0.0, seen.fy, seen.cy, 0.0, 0.0, 1.0],
        "R": np.eye(3).ravel().tolist(),
        "P": [seen.fx, 0.0, seen.cx, 0.0, 0.0, seen.fy, seen.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
