"""Tell the robot of a judged world as its own processes would: the documents of the topics."""

import math
from collections.abc import Mapping
from typing import Any, Final

from benchmarks.planner_flat import FURNITURE, HANDS, FlatThing
from benchmarks.planner_world import FlatWorld

HELD_HEIGHT_M: Final = 0.72
BOX_FLOOR_M: Final = 0.008
FELT: Final[Mapping[bool, str]] = {True: "holding", False: "empty"}


def scene_document(world: FlatWorld, stamp_ns: int) -> dict[str, Any]:
    """Return the scene topic's document of what the robot has seen."""
    seen = [thing for thing in world.things.values() if thing.is_seen]
    x_m, y_m, yaw_rad = world.pose
    return {
        "stamp_ns": stamp_ns,
        "objects": [_object(thing, world, stamp_ns) for thing in seen],
        "surfaces": _surfaces(world, seen),
        "lost": [],
        "bystanders": [],
        "hands": {hand: _hand(world.held_in(hand)) for hand in HANDS},
        "robot": {"x_m": x_m, "y_m": y_m, "yaw_rad": _wrapped(yaw_rad)},
    }


def executor_document(world: FlatWorld) -> dict[str, Any]:
    """Return the status of an executor that has nothing to do."""
    held = {hand: world.held_in(hand) for hand in HANDS}
    return {
        "state": "idle",
        "commands": [],
        "command_id": None,
        "action_id": None,
        "skill": None,
        "holding": {hand: thing.kind if thing else None for hand, thing in held.items()},
    }


def _object(thing: FlatThing, world: FlatWorld, stamp_ns: int) -> dict[str, Any]:
    x_m, y_m = world.place_of(thing)
    told: dict[str, Any] = {
        "id": thing.thing_id,
        "class": thing.kind,
        "colour": thing.colour,
        "position_m": [x_m, y_m, _bottom_m(thing, world) + 0.5 * thing.size_m[2]],
        "size_m": list(thing.size_m),
        "yaw_rad": 0.0,
        "last_seen_ns": stamp_ns,
        "seen_count": 40,
        "confidence": 0.98,
        "sigma_m": [0.006, 0.006, 0.006],
    }
    told |= {"aliases": list(thing.aliases)} if thing.aliases else {}
    if thing.held_by:
        return told | {"held_by": thing.held_by}
    return told | {"rests": {"relation": thing.rests[0], "of": thing.rests[1]}}


def _bottom_m(thing: FlatThing, world: FlatWorld) -> float:
    if thing.held_by:
        return HELD_HEIGHT_M
    relation, of = thing.rests
    below = world.things.get(of)
    if below is None:
        return FURNITURE[of].height_m if of in FURNITURE else 0.0
    return _bottom_m(below, world) + (BOX_FLOOR_M if relation == "in" else below.size_m[2])


def _surfaces(world: FlatWorld, seen: list[FlatThing]) -> list[dict[str, Any]]:
    names = {world.furniture_of(thing) for thing in seen if not thing.held_by} & set(FURNITURE)
    return [
        {
            "name": name,
            "height_m": FURNITURE[name].height_m,
            "polygon_m": [list(corner) for corner in FURNITURE[name].corners_m()],
        }
        for name in sorted(names)
    ]


def _hand(held: FlatThing | None) -> dict[str, Any]:
    kind = held.kind if held else None
    return {
        "holding": held.thing_id if held else None,
        "class": kind,
        "told": kind,
        "felt": FELT[held is not None],
        "confirmed": held is not None,
        "width_m": held.size_m[1] if held else None,
        "drift_m": 0.0,
        "effort_ratio": 0.2 if held else 0.0,
        "cause": "",
    }


def _wrapped(angle_rad: float) -> float:
    return math.remainder(angle_rad, 2 * math.pi)
