"""Read the scene topic's document into values; fields that older writers lack have defaults."""

from collections.abc import Mapping, Sequence
from typing import Any

from vla_deploy.world.errors import SceneUnreadable
from vla_deploy.world.thing import Lost, Rest, Snapshot, Surface, Thing, Vector, Viewpoint


def read_snapshot(document: Mapping[str, Any], now_ns: int | None = None) -> Snapshot:
    """Return a scene document as a snapshot of `now_ns`, of its own stamp by default.

    Raises:
        SceneUnreadable: a field that every scene has is missing or of another form.
    """
    try:
        return Snapshot(
            stamp_ns=int(document["stamp_ns"]) if now_ns is None else now_ns,
            things=tuple(read_thing(one) for one in document["objects"]),
            surfaces=tuple(_surface(one) for one in document.get("surfaces", ())),
            lost=tuple(
                Lost(thing=read_thing(one), cause=str(one.get("cause", "")))
                for one in document.get("lost", ())
            ),
            robot=_viewpoint(document.get("robot")),
            hands=dict(document.get("hands", {})),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SceneUnreadable(
            f"the scene document is not one: {type(error).__name__} {error}; expected stamp_ns and "
            "objects with id, class, colour, position_m; see docs/world-model.md"
        ) from error


def read_thing(told: Mapping[str, Any]) -> Thing:
    """Return one object of the scene document.

    Raises:
        KeyError: it lacks its id, class, colour or position.
        ValueError: a vector has not three numbers.
    """
    rests = told.get("rests")
    return Thing(
        thing_id=str(told["id"]),
        kind=str(told["class"]),
        colour=str(told["colour"]),
        position_m=_vector(told["position_m"]),
        size_m=_vector(told.get("size_m", (0.0, 0.0, 0.0))),
        yaw_rad=float(told.get("yaw_rad", 0.0)),
        last_seen_ns=int(told.get("last_seen_ns", 0)),
        confidence=float(told.get("confidence", 1.0)),
        sigma_m=_vector(told.get("sigma_m", (0.0, 0.0, 0.0))),
        rests=None if rests is None else Rest(str(rests["relation"]), str(rests["of"])),
        held_by=str(told.get("held_by", "")),
        aliases=tuple(str(name) for name in told.get("aliases", ())),
    )


def _surface(told: Mapping[str, Any]) -> Surface:
    corners = tuple((float(x_m), float(y_m)) for x_m, y_m in told["polygon_m"])
    return Surface(
        name=str(told.get("name", "surface")), height_m=float(told["height_m"]), polygon_m=corners
    )


def _viewpoint(told: Mapping[str, Any] | None) -> Viewpoint | None:
    if told is None:
        return None
    return Viewpoint(x_m=float(told["x_m"]), y_m=float(told["y_m"]), yaw_rad=float(told["yaw_rad"]))


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
