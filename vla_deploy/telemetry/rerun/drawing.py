"""Draw the messages in Foxglove's schemas as entities: frames, sensors, scenes, images, logs."""

import base64
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from vla_deploy.ipc.rgbd_image import MILLIMETRE_M
from vla_deploy.telemetry.rerun.entity import (
    LOGS,
    WORLD,
    Entity,
    child_path,
    frame_path,
    path_part,
)
from vla_deploy.telemetry.schemas.foxglove_json import CAMERA, Json

_POINT_TYPES: Final = {7: "<f4", 8: "<f8"}  # foxglove.NumericType
_LOG_LEVELS: Final = ("INFO", "DEBUG", "INFO", "WARN", "ERROR", "CRITICAL")  # foxglove.Log
_COLOUR_PARTS: Final = 4
_PER_METRE: Final = round(1 / MILLIMETRE_M)
_AXIS_M: Final = 0.05
_POSE_M: Final = 0.4
_POINT_M: Final = 0.015
_NAME_M: Final = 0.01
Shapes = list[tuple[str, Json]]


def transforms(message: Json) -> Iterator[Entity]:
    """Yield every frame in its parent, with axes; the camera is shown by its lens."""
    for one in message["transforms"]:
        path = child_path(one["parent_frame_id"], one["child_frame_id"])
        yield _placed(path, one["translation"], one["rotation"])
        if one["child_frame_id"] != CAMERA:
            yield _axes(path)


def heading(message: Json) -> Iterator[Entity]:
    """Yield an arrow in the heading of the base."""
    pose = message["pose"]
    turn = pose["orientation"]
    yaw_rad = 2 * math.atan2(turn["z"], turn["w"])
    vector = [_POSE_M * math.cos(yaw_rad), _POSE_M * math.sin(yaw_rad), 0.0]
    values = {"origins": [_xyz(pose["position"])], "vectors": [vector]}
    path = f"{frame_path(message['frame_id'])}/pose"
    yield Entity(path=path, archetype="Arrows3D", values=values)


def odometry(message: Json) -> Iterator[Entity]:
    """Yield the base's pose by its wheels, in a space of its own."""
    path = f"{frame_path(message['frame_id'])}/base"
    yield _placed(path, message["pose"]["position"], message["pose"]["orientation"])
    yield _axes(path)


def scan(message: Json) -> Iterator[Entity]:
    """Yield the returns of the lidar as points; 0 is none."""
    ranges = np.array(message["ranges"], dtype=np.float64)
    angles = np.linspace(message["start_angle"], message["end_angle"], ranges.size)
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * ranges], axis=1)
    seen = points[np.isfinite(ranges) & (ranges > 0)] + _xyz(message["pose"]["position"])
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
    """Yield the map; an image's first row is the top, the message's is the bottom."""
    columns = message["column_count"]
    cells = np.frombuffer(base64.b64decode(message["data"]), np.uint8)
    # Our maps are grey: one part of each colour is enough; the viewer warns of maps with four.
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
        "translation": _xyz(message["pose"]["position"]),
    }
    path = f"{frame_path(message['frame_id'])}/map"
    yield Entity(path=path, archetype="GridMap", values=values, static=True)


def lens(message: Json) -> Iterator[Entity]:
    """Yield the camera's lens, which places its images in space."""
    values = {
        "image_from_camera": np.reshape(message["K"], (3, 3)).tolist(),
        "resolution": [message["width"], message["height"]],
    }
    path = frame_path(message["frame_id"])
    yield Entity(path=path, archetype="Pinhole", values=values, static=True)


def colour(message: Json) -> Iterator[Entity]:
    """Yield the camera's colour image."""
    values = {
        "contents": base64.b64decode(message["data"]),
        "media_type": f"image/{message['format']}",
    }
    path = f"{frame_path(message['frame_id'])}/colour"
    yield Entity(path=path, archetype="EncodedImage", values=values)


def depth(message: Json) -> Iterator[Entity]:
    """Yield the camera's depth image, which is shown as points."""
    values = {
        "blob": base64.b64decode(message["data"]),
        "media_type": f"image/{message['format']}",
        "meter": _PER_METRE,
    }
    path = f"{frame_path(message['frame_id'])}/depth"
    yield Entity(path=path, archetype="EncodedDepthImage", values=values)


def line(message: Json) -> Iterator[Entity]:
    """Yield a line of a process' log."""
    values = {"text": str(message["message"]), "level": _LOG_LEVELS[message["level"]]}
    path = f"{LOGS}/{path_part(message['name'])}"
    yield Entity(path=path, archetype="TextLog", values=values)


def event(topic: str, text: bytes) -> Iterator[Entity]:
    """Yield an event of a ring as its JSON."""
    values = {"text": text.decode(), "level": "INFO"}
    yield Entity(path=f"{LOGS}/events/{topic}", archetype="TextLog", values=values)


def scene(message: Json) -> Iterator[Entity]:
    """Yield the whole scene, which replaces the one before."""
    yield from _drawn("scene", message["entities"], static=False)


def zones(message: Json) -> Iterator[Entity]:
    """Yield the keep-out zones."""
    yield from _drawn("zones", message["entities"], static=True)


def _xyz(point: Json) -> list[float]:
    """Return a point or a vector as three numbers."""
    return [float(point[axis]) for axis in "xyz"]


def _quaternion(turn: Json) -> list[float]:
    """Return a quaternion in Rerun's order: x, y, z, w."""
    return [float(turn[axis]) for axis in "xyzw"]


def _placed(path: str, translation: Json, rotation: Json) -> Entity:
    values = {"translation": _xyz(translation), "quaternion": _quaternion(rotation)}
    return Entity(path=path, archetype="Transform3D", values=values)


def _axes(path: str) -> Entity:
    axis_m = _AXIS_M if path.startswith(f"{WORLD}/base/") else _POSE_M
    return Entity(
        path=path, archetype="TransformAxes3D", values={"axis_length": axis_m}, static=True
    )


def _points(path: str, points: np.ndarray) -> Entity:
    values = {"positions": points.astype(np.float32), "radii": _POINT_M}
    return Entity(path=path, archetype="Points3D", values=values)


def _drawn(name: str, entities: Iterable[Json], *, static: bool) -> Iterator[Entity]:
    found: dict[str, Shapes] = {kind: [] for kind in _KINDS}
    root = frame_path("map")
    for entity in entities:
        root = frame_path(entity["frame_id"])
        for kind, shapes in found.items():
            shapes.extend((entity["id"], shape) for shape in entity[kind])
    for kind, (place, archetype, values) in _KINDS.items():
        if static and not found[kind]:
            continue  # while in a scene that changes, an empty list removes shapes
        yield Entity(
            path=f"{root}/{name}/{place}",
            archetype=archetype,
            values=values(found[kind]),
            static=static,
        )


def _boxes(shapes: Shapes) -> dict[str, Any]:
    return {
        "centers": [_xyz(one["pose"]["position"]) for _, one in shapes],
        "quaternions": [_quaternion(one["pose"]["orientation"]) for _, one in shapes],
        "sizes": [_xyz(one["size"]) for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "labels": [name for name, _ in shapes],
    }


def _cylinders(shapes: Shapes) -> dict[str, Any]:
    return {
        "centers": [_xyz(one["pose"]["position"]) for _, one in shapes],
        "lengths": [float(one["size"]["z"]) for _, one in shapes],
        "radii": [float(one["size"]["x"]) / 2 for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "labels": [name for name, _ in shapes],
    }


def _outlines(shapes: Shapes) -> dict[str, Any]:
    corners = [[_xyz(point) for point in one["points"]] for _, one in shapes]
    return {
        "strips": [[*outline, *outline[:1]] for outline in corners],
        "radii": [one["thickness"] / 2 for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
    }


def _names(shapes: Shapes) -> dict[str, Any]:
    return {
        "positions": [_xyz(one["pose"]["position"]) for _, one in shapes],
        "labels": [one["text"] for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "radii": _NAME_M,
    }


def _rgba(colour: Json) -> list[int]:
    return [round(255 * min(max(float(colour[part]), 0.0), 1.0)) for part in "rgba"]


# By the shapes of a scene: last part of the path, archetype, and its values.
_KINDS: Final[Mapping[str, tuple[str, str, Callable[[Shapes], dict[str, Any]]]]] = {
    "cubes": ("boxes", "Boxes3D", _boxes),
    "cylinders": ("people", "Cylinders3D", _cylinders),
    "lines": ("outlines", "LineStrips3D", _outlines),
    "texts": ("names", "Points3D", _names),
}
