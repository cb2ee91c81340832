"""Read the scene topic's document into values, and write the world as one document for scripts.

Fields that older writers of the topic lack have defaults. `docs/world-model.md` lists the report.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.world.access import Body, access_to
from vla_deploy.world.errors import SceneUnreadable
from vla_deploy.world.memory import place_of, seen_words, still_there, where_to_look
from vla_deploy.world.query import Query, find
from vla_deploy.world.relations import relations_of
from vla_deploy.world.thing import Lost, Rest, Snapshot, Surface, Thing, Vector, Viewpoint
from vla_deploy.world.vocabulary import distance_word, form_words, size_word

Point = tuple[float, float]


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


def report(
    snapshot: Snapshot,
    query: Query,
    body: Body,
    places: Mapping[str, Point],
    view: Viewpoint | None = None,
) -> dict[str, Any]:
    """Return everything about the things meant, as `view` (the robot's by default) sees them."""
    view = view or snapshot.robot
    meant = find(query, snapshot, view)
    names = {thing.thing_id for thing in meant}
    return {
        "stamp_ns": snapshot.stamp_ns,
        "view": None if view is None else asdict(view),
        "query": str(query),
        "things": [_thing(one, snapshot, body, places, view) for one in meant],
        "relations": [asdict(one) for one in relations_of(snapshot, view) if one.subject in names],
        "lost": [_lost(one, snapshot, places) for one in snapshot.lost if query.fits(one.thing)],
        "where_to_look": [asdict(one) for one in where_to_look(query, snapshot, places)],
        "hands": dict(snapshot.hands),
        "surfaces": [asdict(one) for one in snapshot.surfaces],
        "robot": _robot(snapshot.robot),
    }


def read_report(document: Mapping[str, Any]) -> Snapshot:
    """Return the world that a report tells of: only the things that were asked for.

    Raises:
        SceneUnreadable: the document is no report.
    """
    try:
        stamp_ns = int(document["stamp_ns"])
        things = [_object(one, stamp_ns) for one in document["things"]]
        lost = [
            _object({**one, "position_m": one["last_position_m"]}, stamp_ns)
            for one in document.get("lost", ())
        ]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SceneUnreadable(
            f"the scene is not one: {type(error).__name__} {error}; expected what "
            "vla-deploy scene --json prints; see docs/world-model.md"
        ) from error
    return read_snapshot({**document, "objects": things, "lost": lost})


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


def _object(told: Mapping[str, Any], stamp_ns: int) -> dict[str, Any]:
    """Return a thing of a report as the scene topic tells it, without nulls."""
    known = {key: value for key, value in told.items() if value is not None}
    unseen_ns = round(float(known.get("unseen_s", 0.0)) * NS_PER_S)
    return {**known, "last_seen_ns": stamp_ns - unseen_ns}


def _thing(
    thing: Thing,
    snapshot: Snapshot,
    body: Body,
    places: Mapping[str, Point],
    view: Viewpoint | None,
) -> dict[str, Any]:
    distance_m = None if view is None else math.dist((view.x_m, view.y_m), thing.xy_m)
    unseen_s = snapshot.unseen_s(thing)
    return {
        **_facts(thing, snapshot),
        "position_m": _rounded(thing.position_m),
        "size": size_word(thing),
        "form": list(form_words(thing)),
        "distance_m": None if distance_m is None else round(distance_m, 3),
        "distance": None if distance_m is None else distance_word(distance_m),
        "place": place_of(thing, places),
        "seen": seen_words(unseen_s),
        "still_there": round(still_there(thing, unseen_s), 3),
        "access": access_to(thing, snapshot, body).document(),
    }


def _lost(lost: Lost, snapshot: Snapshot, places: Mapping[str, Point]) -> dict[str, Any]:
    return {
        **_facts(lost.thing, snapshot),
        "last_place": place_of(lost.thing, places),
        "last_position_m": _rounded(lost.thing.position_m),
        "cause": lost.cause,
    }


def _facts(thing: Thing, snapshot: Snapshot) -> dict[str, Any]:
    """Return what holds wherever the thing is now."""
    return {
        "id": thing.thing_id,
        "aliases": list(thing.aliases),
        "class": thing.kind,
        "colour": thing.colour,
        "sigma_m": _rounded(thing.sigma_m),
        "size_m": _rounded(thing.size_m),
        "yaw_rad": round(thing.yaw_rad, 4),
        "rests": None if thing.rests is None else asdict(thing.rests),
        "held_by": thing.held_by or None,
        "confidence": thing.confidence,
        "unseen_s": round(snapshot.unseen_s(thing), 2),
    }


def _robot(robot: Viewpoint | None) -> dict[str, float] | None:
    if robot is None:
        return None
    return {"x_m": robot.x_m, "y_m": robot.y_m, "yaw_rad": robot.yaw_rad}


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, 4) for value in values]
