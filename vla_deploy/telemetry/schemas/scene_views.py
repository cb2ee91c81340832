"""Draw the robot's surroundings: objects, surfaces, people, keep-out zones and the map."""

import base64
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from vla_deploy.robots import RobotDescription
from vla_deploy.robots.maps.grid_map import load_map
from vla_deploy.telemetry.schemas.foxglove_json import (
    MAP,
    Json,
    colour_json,
    floor_pose_json,
    point_json,
    time_json,
)

_FOREVER: Final = {"sec": 0, "nsec": 0}
_SEEN_FOR: Final = {"sec": 3, "nsec": 0}  # longer than the scene may be old
_LINE_LOOP: Final = 1
_GREY: Final = (0.6, 0.6, 0.6)
_SURFACE: Final = (0.3, 0.6, 0.9)
_PERSON: Final = (1.0, 0.5, 0.0)
_ZONE: Final = (0.9, 0.1, 0.1)
_COLOURS: Final[Mapping[str, tuple[float, float, float]]] = {
    "red": (0.85, 0.1, 0.1),
    "green": (0.1, 0.65, 0.2),
    "blue": (0.1, 0.3, 0.9),
    "yellow": (0.95, 0.85, 0.1),
    "orange": (0.95, 0.5, 0.1),
    "purple": (0.5, 0.2, 0.7),
    "pink": (0.95, 0.5, 0.7),
    "brown": (0.45, 0.3, 0.15),
    "black": (0.1, 0.1, 0.1),
    "white": (0.95, 0.95, 0.95),
}
_KINDS: Final = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
_TEXT_M: Final = 0.06
_LINE_M: Final = 0.02
_DELETE_ALL: Final = 1
_UINT8: Final = 1  # foxglove.NumericType
_FREE: Final = (235, 235, 235, 255)
_BLOCKED: Final = (110, 110, 110, 255)
_SEEN_BY_LIDAR: Final = (30, 30, 30, 255)


def scene(document: Mapping[str, Any], stamp_ns: int) -> Json:
    """Return the whole scene; it replaces the one before."""
    entities = [
        *(_object(one, stamp_ns) for one in document.get("objects", ())),
        *(_surface(i, one, stamp_ns) for i, one in enumerate(document.get("surfaces", ()))),
        *(_bystander(i, one, stamp_ns) for i, one in enumerate(document.get("bystanders", ()))),
    ]
    forget = {"timestamp": time_json(stamp_ns), "type": _DELETE_ALL, "id": ""}
    return {"deletions": [forget], "entities": entities}


def zones(robot: RobotDescription, stamp_ns: int) -> Json:
    """Return the keep-out zones of the base."""
    entities = [
        _entity(
            f"zone/{zone.name}",
            stamp_ns,
            _FOREVER,
            lines=[_outline(zone.polygon_m, 0.01, _ZONE)],
            texts=[_text(zone.name, *_middle(zone.polygon_m), 0.05)],
        )
        for zone in (robot.parts.home.zones if robot.parts.home else ())
    ]
    return {"deletions": [], "entities": entities}


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


def _object(thing: Mapping[str, Any], stamp_ns: int) -> Json:
    x_m, y_m, z_m = thing["position_m"]
    cube = {
        "pose": floor_pose_json(x_m, y_m, thing["yaw_rad"], z_m),
        "size": point_json(*thing["size_m"]),
        "color": colour_json(_COLOURS.get(thing["colour"], _GREY), 0.8),
    }
    top_m = z_m + thing["size_m"][2] / 2 + _TEXT_M
    return _entity(
        f"object/{thing['id']}",
        stamp_ns,
        _SEEN_FOR,
        cubes=[cube],
        texts=[_text(thing["id"], x_m, y_m, top_m)],
    )


def _surface(index: int, surface: Mapping[str, Any], stamp_ns: int) -> Json:
    outline = _outline(surface["polygon_m"], surface["height_m"], _SURFACE)
    return _entity(f"surface/{index}", stamp_ns, _SEEN_FOR, lines=[outline])


def _bystander(index: int, one: Mapping[str, Any], stamp_ns: int) -> Json:
    x_m, y_m, *_ = one["position_m"]
    width_m, top_m = one["width_m"], one["top_m"]
    cylinder = {
        "pose": floor_pose_json(x_m, y_m, 0.0, top_m / 2),
        "size": point_json(width_m, width_m, top_m),
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": colour_json(_PERSON, 0.5),
    }
    texts = [_text(one["class"], x_m, y_m, top_m + _TEXT_M)]
    return _entity(f"bystander/{index}", stamp_ns, _SEEN_FOR, cylinders=[cylinder], texts=texts)


def _entity(name: str, stamp_ns: int, lifetime: Json, **shapes: list[Json]) -> Json:
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": MAP,
        "id": name,
        "lifetime": lifetime,
        "frame_locked": True,
        "metadata": [],
        **{kind: shapes.get(kind, []) for kind in _KINDS},
    }


def _outline(
    polygon_m: Sequence[Sequence[float]], height_m: float, colour: Sequence[float]
) -> Json:
    return {
        "type": _LINE_LOOP,
        "pose": floor_pose_json(0.0, 0.0, 0.0),
        "thickness": _LINE_M,
        "scale_invariant": False,
        "points": [point_json(x_m, y_m, height_m) for x_m, y_m in polygon_m],
        "color": colour_json(colour),
        "colors": [],
        "indices": [],
    }


def _text(words: str, x_m: float, y_m: float, z_m: float) -> Json:
    return {
        "pose": floor_pose_json(x_m, y_m, 0.0, z_m),
        "billboard": True,
        "font_size": _TEXT_M,
        "scale_invariant": False,
        "color": colour_json(_GREY),
        "text": words,
    }


def _middle(polygon_m: Sequence[Sequence[float]]) -> tuple[float, float]:
    count = len(polygon_m)
    return sum(corner[0] for corner in polygon_m) / count, sum(c[1] for c in polygon_m) / count
