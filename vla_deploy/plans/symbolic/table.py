"""List, for each skill, what must hold before it, and how it changes the state if it succeeds."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

from vla_deploy.plans.catalogue import SWITCHING
from vla_deploy.plans.symbolic import conditions
from vla_deploy.plans.symbolic.conditions import (
    SMALL_MOVE_M,
    Condition,
    Setting,
    rest_of_subject,
)
from vla_deploy.plans.symbolic.state import HeldSymbol, SymbolicState
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import ON
from vla_deploy.world.thing import Rest

Effect = Callable[[SymbolicState, Setting], SymbolicState]


def goes(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Stand at the goal."""
    place, subject = setting.place("place"), setting.subject("object")
    if subject is not None:
        spot = None if subject.thing is None else subject.thing.xy_m
        return replace(state, at=subject.key, spot=spot, pose=None)
    if place is not None:
        site = setting.world.sites.get(place)
        if site is None:
            return replace(state, at=place, spot=None, pose=None)
        pose = (site.pose.x_m, site.pose.y_m, site.pose.yaw_rad)
        return replace(state, at=place, spot=pose[:2], pose=pose)
    x_m, y_m = float(setting.parameters["x_m"]), float(setting.parameters["y_m"])
    yaw_rad = setting.parameters.get("yaw_rad")
    facing = None if yaw_rad is None else (x_m, y_m, float(yaw_rad))
    return replace(state, at="", spot=(x_m, y_m), pose=facing)


def moves(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Stand a way ahead."""
    way_m = float(setting.parameters["distance_m"])
    at = state.at if abs(way_m) < SMALL_MOVE_M else ""
    if state.pose is None:
        return replace(state, at=at, spot=state.spot if at else None)
    x_m, y_m, yaw_rad = state.pose
    x_m, y_m = x_m + way_m * math.cos(yaw_rad), y_m + way_m * math.sin(yaw_rad)
    return replace(state, at=at, spot=(x_m, y_m), pose=(x_m, y_m, yaw_rad))


def turns(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Look another way, and so stand before nothing any more."""
    if state.pose is None:
        return replace(state, at="")
    x_m, y_m, yaw_rad = state.pose
    yaw_rad = math.remainder(yaw_rad + float(setting.parameters["angle_rad"]), 2 * math.pi)
    return replace(state, at="", pose=(x_m, y_m, yaw_rad))


def keeps_watch(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Stand at the place that is guarded, or where the robot is."""
    return goes(state, setting) if setting.place("place") is not None else state


def strays(state: SymbolicState, _: Setting) -> SymbolicState:
    """Stand wherever somebody, or the work, has led."""
    return replace(state, at="", spot=None, pose=None)


def finds(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Know where the thing is; the search may have led anywhere unless it was in the scene."""
    subject = setting.subject("object")
    if subject is None or subject.key in state.found:
        return state
    found = state.found | {subject.key}
    if subject.thing is not None or subject.others:
        return replace(state, found=found)
    return strays(replace(state, found=found), setting)


def takes(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Hold the thing in the hand that is named, or the only free one."""
    subject = setting.subject("object")
    if subject is None or state.holds(subject.key):
        return state
    free = [hand for hand in state.hands if not any(one.hand == hand for one in state.held)]
    only = free[0] if len(free) == 1 else ""
    hand = str(setting.parameters.get("arm", only))
    return state.taking(HeldSymbol(key=subject.key, kind=subject.kind, hand=hand))


def puts(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Hold the thing no longer, and let it rest where it was put."""
    held = state.holding(str(setting.parameters.get("arm", "")))[:1]
    rest = _rest_at_destination(state, setting)
    put = {one.key: rest for one in held}
    return replace(state.without(held), rests={**state.rests, **put})


def _rest_at_destination(state: SymbolicState, setting: Setting) -> Rest:
    """Return what it rests in or on then; beside a thing, on what that rests on."""
    subject, relation = setting.subject("destination"), str(setting.parameters.get("relation", ON))
    if subject is None:
        return Rest(relation, setting.place("destination") or "")
    if relation != NEXT_TO:
        return Rest(relation, subject.key)
    below = rest_of_subject(state, subject)
    return Rest(ON, below.of if below is not None else "")


def lets_go(state: SymbolicState, setting: Setting) -> SymbolicState:
    """Hold nothing in the hand that opens."""
    return state.without(state.holding(str(setting.parameters.get("arm", ""))))


def stays(state: SymbolicState, _: Setting) -> SymbolicState:
    """Change nothing that plans are about."""
    return state


@dataclass(frozen=True, slots=True, kw_only=True)
class Logic:
    """Hold a skill's preconditions by name, and its effect."""

    needs: Mapping[str, Condition]
    effect: Effect = stays


KNOWN: Final = "object known"
BEFORE: Final = "robot before it"
FREE_HAND: Final = "hand free"
HOLDING: Final = "something held"
WHICH_HAND: Final = "hand named"

LOGIC: Final[Mapping[str, Logic]] = MappingProxyType(
    {
        "navigate_to": Logic(
            needs={
                KNOWN: conditions.is_known,
                "not held": conditions.is_not_held,
                "area allowed": conditions.may_go_there,
                "speed allowed": conditions.is_slow_enough,
            },
            effect=goes,
        ),
        "charge": Logic(needs={"area allowed": conditions.may_go_there}, effect=goes),
        "move": Logic(
            needs={
                "area allowed": conditions.way_is_allowed,
                "speed allowed": conditions.is_slow_enough,
            },
            effect=moves,
        ),
        "follow_person": Logic(needs={}, effect=strays),
        "guard": Logic(needs={"area allowed": conditions.may_go_there}, effect=keeps_watch),
        "inspect": Logic(
            needs={
                KNOWN: conditions.is_known,
                "not held": conditions.is_not_held,
                "area allowed": conditions.may_go_there,
            },
            effect=strays,
        ),
        "sweep": Logic(needs={"area allowed": conditions.may_go_there}, effect=strays),
        "turn": Logic(needs={}, effect=turns),
        "look_at": Logic(needs={KNOWN: conditions.is_known}),
        "find_object": Logic(needs={}, effect=finds),
        "pick_up": Logic(
            needs={
                KNOWN: conditions.is_known,
                "not held": conditions.is_not_held,
                FREE_HAND: conditions.has_free_hand,
                BEFORE: conditions.is_before,
                "graspable": conditions.can_be_gripped,
                "payload": conditions.is_light_enough,
            },
            effect=takes,
        ),
        "place": Logic(
            needs={
                HOLDING: conditions.holds_something,
                WHICH_HAND: conditions.knows_which,
                KNOWN: conditions.is_known,
                "not onto itself": conditions.is_not_held,
                "destination takes things": conditions.takes_things,
                BEFORE: conditions.is_before,
            },
            effect=puts,
        ),
        "hand_over": Logic(
            needs={HOLDING: conditions.holds_something, WHICH_HAND: conditions.knows_which},
            effect=lets_go,
        ),
        "open_gripper": Logic(needs={"nothing dropped": conditions.opens_empty}, effect=lets_go),
        **dict.fromkeys(
            ("close_gripper", "move_arm", "speak", "wait", "stop", *sorted(SWITCHING)),
            Logic(needs={}),
        ),
    }
)
