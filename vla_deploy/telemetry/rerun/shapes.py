"""Draw the shapes of a scene: all boxes are one entity of Rerun's, all outlines another."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from vla_deploy.telemetry.rerun.entity import Entity, frame_path
from vla_deploy.telemetry.rerun.spatial import quaternion, xyz
from vla_deploy.telemetry.schemas.geometry import Json

Shapes = list[tuple[str, Json]]
_NAME_M: Final = 0.01


def scene(message: Json) -> Iterator[Entity]:
    """Yield the whole scene: what is in the message no more is drawn no more."""
    yield from _drawn("scene", message["entities"], static=False)


def zones(message: Json) -> Iterator[Entity]:
    """Yield what stays where it is."""
    yield from _drawn("zones", message["entities"], static=True)


def _drawn(name: str, entities: Iterable[Json], *, static: bool) -> Iterator[Entity]:
    found: dict[str, Shapes] = {kind: [] for kind in _KINDS}
    root = frame_path("map")
    for entity in entities:
        root = frame_path(entity["frame_id"])
        for kind, shapes in found.items():
            shapes.extend((entity["id"], shape) for shape in entity[kind])
    for kind, (place, archetype, values) in _KINDS.items():
        if static and not found[kind]:
            continue  # of what changes, no shape at all has to be told
        yield Entity(
            path=f"{root}/{name}/{place}",
            archetype=archetype,
            values=values(found[kind]),
            static=static,
        )


def _boxes(shapes: Shapes) -> dict[str, Any]:
    return {
        "centers": [xyz(one["pose"]["position"]) for _, one in shapes],
        "quaternions": [quaternion(one["pose"]["orientation"]) for _, one in shapes],
        "sizes": [xyz(one["size"]) for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "labels": [name for name, _ in shapes],
    }


def _cylinders(shapes: Shapes) -> dict[str, Any]:
    return {
        "centers": [xyz(one["pose"]["position"]) for _, one in shapes],
        "lengths": [float(one["size"]["z"]) for _, one in shapes],
        "radii": [float(one["size"]["x"]) / 2 for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "labels": [name for name, _ in shapes],
    }


def _outlines(shapes: Shapes) -> dict[str, Any]:
    corners = [[xyz(point) for point in one["points"]] for _, one in shapes]
    return {
        "strips": [[*outline, *outline[:1]] for outline in corners],
        "radii": [one["thickness"] / 2 for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
    }


def _names(shapes: Shapes) -> dict[str, Any]:
    return {
        "positions": [xyz(one["pose"]["position"]) for _, one in shapes],
        "labels": [one["text"] for _, one in shapes],
        "colors": [_rgba(one["color"]) for _, one in shapes],
        "radii": _NAME_M,
    }


def _rgba(colour: Json) -> list[int]:
    return [round(255 * min(max(float(colour[part]), 0.0), 1.0)) for part in "rgba"]


# What our scenes are made of: last part of the path, archetype, and its values.
_KINDS: Final[Mapping[str, tuple[str, str, Callable[[Shapes], dict[str, Any]]]]] = {
    "cubes": ("boxes", "Boxes3D", _boxes),
    "cylinders": ("people", "Cylinders3D", _cylinders),
    "lines": ("outlines", "LineStrips3D", _outlines),
    "texts": ("names", "Points3D", _names),
}
