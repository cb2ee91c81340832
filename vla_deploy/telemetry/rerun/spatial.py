"""Draw frames, poses and what sensors measure, from the messages in Foxglove's schemas."""

import base64
import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from vla_deploy.telemetry.rerun.entity import WORLD, Entity, child_path, frame_path
from vla_deploy.telemetry.schemas.geometry import CAMERA, Json

_POINT_TYPES: Final = {7: "<f4", 8: "<f8"}  # foxglove.NumericType
_COLOUR_PARTS: Final = 4
_AXIS_M: Final = 0.05
_POSE_M: Final = 0.4
_POINT_M: Final = 0.015


def transforms(message: Json) -> Iterator[Entity]:
    """Yield every frame in its parent, with axes that can be seen; of a camera its lens is."""
    for one in message["transforms"]:
        path = child_path(one["parent_frame_id"], one["child_frame_id"])
        yield _placed(path, one["translation"], one["rotation"])
        if one["child_frame_id"] != CAMERA:
            yield _axes(path)


def heading(message: Json) -> Iterator[Entity]:
    """Yield an arrow that points where the base looks."""
    pose = message["pose"]
    turn = pose["orientation"]
    yaw_rad = 2 * math.atan2(turn["z"], turn["w"])
    vector = [_POSE_M * math.cos(yaw_rad), _POSE_M * math.sin(yaw_rad), 0.0]
    values = {"origins": [xyz(pose["position"])], "vectors": [vector]}
    path = f"{frame_path(message['frame_id'])}/pose"
    yield Entity(path=path, archetype="Arrows3D", values=values)


def odometry(message: Json) -> Iterator[Entity]:
    """Yield where the wheels have brought the base, in a space of its own."""
    path = f"{frame_path(message['frame_id'])}/base"
    yield _placed(path, message["pose"]["position"], message["pose"]["orientation"])
    yield _axes(path)


def scan(message: Json) -> Iterator[Entity]:
    """Yield the returns of the lidar as points; 0 is none."""
    ranges = np.array(message["ranges"], dtype=np.float64)
    angles = np.linspace(message["start_angle"], message["end_angle"], ranges.size)
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * ranges], axis=1)
    seen = points[np.isfinite(ranges) & (ranges > 0)] + xyz(message["pose"]["position"])
    yield _points(f"{frame_path(message['frame_id'])}/scan", seen)


def obstacles(message: Json) -> Iterator[Entity]:
    """Yield the points of a cloud."""
    fields = {field["name"]: field for field in message["fields"]}
    packed = np.dtype(
        {
            "names": list("xyz"),
            "formats": [_POINT_TYPES[fields[axis]["type"]] for axis in "xyz"],
            "offsets": [fields[axis]["offset"] for axis in "xyz"],
            "itemsize": message["point_stride"],
        }
    )
    rows = np.frombuffer(base64.b64decode(message["data"]), packed)
    points = np.stack([rows[axis] for axis in "xyz"], axis=1)
    yield _points(f"{frame_path(message['frame_id'])}/near_obstacles", points)


def grid(message: Json) -> Iterator[Entity]:
    """Yield the map; an image begins at the top, the message at the bottom."""
    columns = message["column_count"]
    cells = np.frombuffer(base64.b64decode(message["data"]), np.uint8)
    # Our maps are grey, so that one part of each colour tells it; the viewer flags maps of four.
    rows = cells.reshape(-1, columns, _COLOUR_PARTS)[..., 0]
    values = {
        "data": rows[::-1].tobytes(),
        "format": {
            "width": columns,
            "height": len(rows),
            "color_model": "L",
            "channel_datatype": "U8",
        },
        "colormap": "Grayscale",
        "cell_size": message["cell_size"]["x"],
        "translation": xyz(message["pose"]["position"]),
    }
    path = f"{frame_path(message['frame_id'])}/map"
    yield Entity(path=path, archetype="GridMap", values=values, static=True)


def lens(message: Json) -> Iterator[Entity]:
    """Yield the camera's lens, by which its images stand in space."""
    values = {
        "image_from_camera": np.reshape(message["K"], (3, 3)).tolist(),
        "resolution": [message["width"], message["height"]],
    }
    path = frame_path(message["frame_id"])
    yield Entity(path=path, archetype="Pinhole", values=values, static=True)


def xyz(point: Json) -> list[float]:
    """Return a point or a vector as three numbers."""
    return [float(point[axis]) for axis in "xyz"]


def quaternion(turn: Json) -> list[float]:
    """Return a turn in the order that Rerun has: x, y, z, w."""
    return [float(turn[axis]) for axis in "xyzw"]


def _placed(path: str, translation: Json, rotation: Json) -> Entity:
    values = {"translation": xyz(translation), "quaternion": quaternion(rotation)}
    return Entity(path=path, archetype="Transform3D", values=values)


def _axes(path: str) -> Entity:
    axis_m = _AXIS_M if path.startswith(f"{WORLD}/base/") else _POSE_M
    return Entity(
        path=path, archetype="TransformAxes3D", values={"axis_length": axis_m}, static=True
    )


def _points(path: str, points: np.ndarray) -> Entity:
    values = {"positions": points.astype(np.float32), "radii": _POINT_M}
    return Entity(path=path, archetype="Points3D", values=values)
