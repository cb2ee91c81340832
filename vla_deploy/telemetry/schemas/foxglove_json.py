"""Foxglove's message schemas: their files in `foxglove/`, kept word for word, and their parts."""

import json
import math
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S

MAP: Final = "map"
BASE: Final = "base"
CAMERA: Final = "camera"
ODOM: Final = "odom"
LOG_LEVELS: Final = ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")
"""By the numbers of `foxglove.Log`."""
_PREFIX: Final = "foxglove."

Json = dict[str, Any]
Matrix = NDArray[np.float64]


@cache
def foxglove_schema(name: str) -> dict[str, Any]:
    """Return the JSON schema of a message such as `foxglove.LaserScan`.

    Raises:
        FileNotFoundError: `foxglove/` does not have it.
    """
    file = files(__package__) / "foxglove" / f"{name.removeprefix(_PREFIX)}.json"
    schema: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return schema


def time_json(stamp_ns: int) -> Json:
    """Return a time as seconds and nanoseconds."""
    second, rest = divmod(stamp_ns, NS_PER_S)
    return {"sec": second, "nsec": rest}


def point_json(x: float, y: float, z: float = 0.0) -> Json:
    """Return a point or a vector."""
    return {"x": float(x), "y": float(y), "z": float(z)}


def colour_json(rgb: Sequence[float], alpha: float = 1.0) -> Json:
    """Return a colour; its parts are from 0 to 1."""
    red, green, blue = rgb
    return {"r": float(red), "g": float(green), "b": float(blue), "a": float(alpha)}


def yaw_json(yaw_rad: float) -> Json:
    """Return a rotation about the vertical axis as a quaternion."""
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw_rad / 2), "w": math.cos(yaw_rad / 2)}


def floor_pose_json(x_m: float, y_m: float, yaw_rad: float, z_m: float = 0.0) -> Json:
    """Return a pose that is rotated about the vertical axis only."""
    return {"position": point_json(x_m, y_m, z_m), "orientation": yaw_json(yaw_rad)}


def matrix_json(pose: Matrix) -> tuple[Json, Json]:
    """Return translation and quaternion of a 4 x 4 pose."""
    return point_json(*pose[:3, 3]), _quaternion(pose[:3, :3])


def _quaternion(rotation: Matrix) -> Json:
    """Return the quaternion of a rotation, by Shepperd's method, which is stable at half turns."""
    diagonal = np.diag(rotation)
    parts = np.append(diagonal, diagonal.sum())
    largest = int(np.argmax(parts))
    quaternion = np.empty(4)
    if largest == 3:
        quaternion[3] = 1.0 + parts[3]
        for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
            quaternion[i] = rotation[k, j] - rotation[j, k]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        quaternion[i] = 1.0 + 2.0 * diagonal[i] - parts[3]
        quaternion[j] = rotation[j, i] + rotation[i, j]
        quaternion[k] = rotation[k, i] + rotation[i, k]
        quaternion[3] = rotation[k, j] - rotation[j, k]
    quaternion /= np.linalg.norm(quaternion)
    return dict(zip("xyzw", quaternion.tolist(), strict=True))
