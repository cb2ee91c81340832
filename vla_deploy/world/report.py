"""Write the world as one document for scripts, and read it back: `docs/world-model.md` lists it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.world.access import Body, access_to
from vla_deploy.world.document import read_snapshot
from vla_deploy.world.errors import SceneUnreadable
from vla_deploy.world.memory import place_of, seen_words, still_there, where_to_look
from vla_deploy.world.query import Query, find
from vla_deploy.world.relations import relations_of
from vla_deploy.world.thing import Lost, Snapshot, Thing, Viewpoint
from vla_deploy.world.words import distance_word, form_words, size_word

Point = tuple[float, float]


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
