"""Carry plans out in a small world of symbols, action by action.

Strict where the robot is: what it has not seen it can neither drive to nor take; a hand holds one
thing; what it takes or puts away must be near; things go into boxes, onto furniture and books.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from benchmarks.planner_flat import (
    CONTAINERS,
    FLOOR,
    FURNITURE,
    GRASPABLE,
    HANDS,
    SUPPORTS,
    WITH_SPEAKER,
    FlatThing,
    Point,
)
from benchmarks.planner_words import Unread
from benchmarks.planner_world import ActionFails, FlatWorld

NEAR_M: Final = 1.0
LOOKS: Final = ("ahead", "left", "right", "up", "down")

Parameters = Mapping[str, Any]


def perform(world: FlatWorld, actions: Sequence[Mapping[str, Any]]) -> None:
    """Carry out a plan's actions, each after those that it depends on.

    Raises:
        ActionFails: one of them cannot be carried out.
    """
    for action in in_order(actions):
        skill, parameters = str(action["skill"]), action.get("parameters", {})
        try:
            SKILLS[skill](world, parameters)
        except KeyError as error:
            raise ActionFails(f"{skill}: {error} is missing or unknown") from error
        except (ActionFails, Unread) as error:
            raise ActionFails(f"{skill} {dict(parameters)}: {error}") from error


def in_order(actions: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return actions so that each follows what it depends on, else in the order given.

    Raises:
        ActionFails: some wait for each other, or for what is not in the plan.
    """
    waiting, done, ordered = list(actions), set[str](), list[Mapping[str, Any]]()
    while waiting:
        ready = [
            one
            for one in waiting
            if done.issuperset((*one.get("depends_on", ()), *one.get("after", ())))
        ]
        if not ready:
            raise ActionFails(f"{waiting[0]['id']} waits for what never comes")
        ordered.append(ready[0])
        done.add(str(ready[0]["id"]))
        waiting.remove(ready[0])
    return ordered


def _navigate(world: FlatWorld, given: Parameters) -> None:
    if "place" in given:
        world.stand_at(world.home.places[_place(world, given["place"])])
    elif "object" in given:
        thing = world.known(given["object"])
        if thing.held_by:
            return
        world.stand_at(world.beside(thing))
        world.visited_things.append(thing.thing_id)
    else:
        yaw_rad = float(given.get("yaw_rad", world.pose[2]))
        world.stand_at((float(given["x_m"]), float(given["y_m"]), yaw_rad))


def _move(world: FlatWorld, given: Parameters) -> None:
    x_m, y_m, yaw_rad = world.pose
    way_m = float(given["distance_m"])
    world.stand_at((x_m + way_m * math.cos(yaw_rad), y_m + way_m * math.sin(yaw_rad), yaw_rad))
    world.moved_m += way_m


def _turn(world: FlatWorld, given: Parameters) -> None:
    x_m, y_m, yaw_rad = world.pose
    world.turned_rad += float(given["angle_rad"])
    world.stand_at((x_m, y_m, yaw_rad + float(given["angle_rad"])))


def _look(world: FlatWorld, given: Parameters) -> None:
    if "direction" in given:
        if given["direction"] not in LOOKS:
            raise ActionFails("the head does not turn there")
        world.head = str(given["direction"])
    else:
        world.head = world.known(given["object"]).thing_id


def _find(world: FlatWorld, given: Parameters) -> None:
    try:
        thing = world.known(given["object"])
    except ActionFails:
        thing = world.known(given["object"], among_all=True)
        furniture = world.furniture_of(thing)
        if furniture not in world.home.places or furniture in world.keeps_out:
            raise ActionFails(f"the {thing.kind} is nowhere that the robot looks") from None
        world.stand_at(world.home.places[furniture])
        world.things |= {
            one.thing_id: replace(one, is_seen=True)
            for one in world.things.values()
            if world.furniture_of(one) == furniture
        }
    world.found.append(thing.thing_id)


def _pick(world: FlatWorld, given: Parameters) -> None:
    thing = world.known(given["object"])
    if thing.held_by:
        return
    if thing.kind not in GRASPABLE:
        raise ActionFails(f"no hand takes a {thing.kind}")
    if any(one.rests[1] == thing.thing_id for one in world.things.values()):
        raise ActionFails("something rests on it")
    _must_be_near(world, thing)
    free = [name for name in HANDS if world.held_in(name) is None]
    wanted = [name for name in free if given.get("arm") in (None, name)]
    if not wanted:
        raise ActionFails("no such hand is free")
    world.things[thing.thing_id] = replace(thing, held_by=wanted[0], rests=("", ""))
    world.open_hands[wanted[0]] = False


def _put(world: FlatWorld, given: Parameters) -> None:
    full = [name for name in HANDS if world.held_in(name) is not None]
    hand = next((name for name in full if given.get("arm") in (None, name)), None)
    held = world.held_in(hand) if hand else None
    if hand is None or held is None:
        raise ActionFails("no such hand holds anything")
    of, at_m = _destination(world, given, held)
    relation = "in" if given["relation"] == "in" else "on"
    world.things[held.thing_id] = replace(held, held_by="", rests=(relation, of), xy_m=at_m)
    world.open_hands[hand] = True


def _destination(world: FlatWorld, given: Parameters, held: FlatThing) -> tuple[str, Point]:
    """Return what a thing is put in or on, and where that is.

    Raises:
        ActionFails: nothing can be put there, or not from here.
    """
    relation, text = given["relation"], given["destination"]
    if _is_place(world, text):
        wanted = _place(world, text)
        names = [wanted] if wanted in FURNITURE else list(FURNITURE)
        near = [name for name in names if FURNITURE[name].away_m(world.pose[:2]) < NEAR_M]
        if relation != "on" or not near:
            raise ActionFails("there is no furniture within reach to put it on")
        return near[0], FURNITURE[near[0]].middle_m
    other = world.known(text)
    _must_be_near(world, other)
    if relation == "next to":
        if other.held_by or other.rests[0] != "on" or other.thing_id == held.thing_id:
            raise ActionFails(f"nothing can be put next to the {other.kind}")
        return other.rests[1], world.place_of(other)
    fits = CONTAINERS if relation == "in" else SUPPORTS
    if other.thing_id == held.thing_id or other.kind not in fits:
        raise ActionFails(f"nothing can be put {relation} a {other.kind}")
    return other.thing_id, world.place_of(other)


def _must_be_near(world: FlatWorld, thing: FlatThing) -> None:
    away_m = math.dist(world.place_of(thing), world.pose[:2])
    if away_m > NEAR_M:
        raise ActionFails(f"the {thing.kind} is {away_m:.1f} m away")


def _give(world: FlatWorld, given: Parameters) -> None:
    """Let the person take what is held, who stands before the robot."""
    held = [thing for hand in _hands(given) if (thing := world.held_in(hand)) is not None]
    if len(held) != 1:
        raise ActionFails(f"{len(held)} hands hold something, expected one that it is taken from")
    (given_away,) = held
    world.open_hands[given_away.held_by] = True
    world.things[given_away.thing_id] = replace(
        given_away, held_by="", rests=WITH_SPEAKER, xy_m=world.pose[:2]
    )


def _open(world: FlatWorld, given: Parameters) -> None:
    for hand in _hands(given):
        held = world.held_in(hand)
        if held is not None:
            fallen = replace(held, held_by="", rests=("on", FLOOR), xy_m=world.pose[:2])
            world.things[held.thing_id] = fallen
        world.open_hands[hand] = True


def _close(world: FlatWorld, given: Parameters) -> None:
    world.open_hands |= dict.fromkeys(_hands(given), False)


def _pose_arm(world: FlatWorld, given: Parameters) -> None:
    if given["pose"] not in world.home.arm_poses:
        raise ActionFails("the robot file has no such pose")
    world.arm_pose |= dict.fromkeys(_hands(given), str(given["pose"]))


def _speak(world: FlatWorld, given: Parameters) -> None:
    world.said.append(str(given["text"]))


def _wait(world: FlatWorld, given: Parameters) -> None:
    world.waited_s += float(given["duration_s"])


def _stop(world: FlatWorld, given: Parameters) -> None:
    del world, given


def _hands(given: Parameters) -> tuple[str, ...]:
    arm = given.get("arm")
    if arm not in (None, *HANDS):
        raise ActionFails(f'there is no hand "{arm}"')
    return HANDS if arm is None else (str(arm),)


def _is_place(world: FlatWorld, text: object) -> bool:
    return _plain(text) in world.home.spoken


def _place(world: FlatWorld, text: object) -> str:
    if not _is_place(world, text):
        raise ActionFails(f'no place is called "{text}"')
    return world.home.spoken[_plain(text)]


def _plain(text: object) -> str:
    return str(text).lower().replace("_", " ").strip().removeprefix("the ")


SKILLS: Final[Mapping[str, Callable[[FlatWorld, Parameters], None]]] = MappingProxyType(
    {
        "navigate_to": _navigate, "charge": _navigate, "move": _move, "turn": _turn,
        "look_at": _look, "find_object": _find, "pick_up": _pick, "place": _put, "hand_over": _give,
        "open_gripper": _open, "close_gripper": _close, "move_arm": _pose_arm, "speak": _speak,
        "wait": _wait, "stop": _stop,
    }
)  # fmt: skip
