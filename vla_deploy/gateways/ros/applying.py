"""Derive from the parameters what changes in the robot file and the profile, and what holds then.

A value that is not given changes nothing; nothing makes the robot faster than its own file does.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from platforms import Profile
from vla_deploy.gateways.ros.parameters import PARAMETERS
from vla_deploy.plans.knowledge import spoken_places, words_of
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import KeepOutZone, Place
from vla_deploy.robots.plan_bounds import Confirm

AREA_SIDE_M: Final = 0.6
WITHIN_S: Final = (1.0, 300.0)
"""What a profile's [planning] within_s may be."""
_AREA: Final = "restricted_area_of_"
_REASON: Final = "the parameter restricted_areas keeps the robot out of it"
_DEFAULTS: Final = {one.name: one.default for one in PARAMETERS}
Values = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterEffects:
    """Hold tables that go over robot file and profile, what does not hold as given, and faults."""

    robot: dict[str, dict[str, Any]] = field(default_factory=dict)
    profile: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def effects_of(given: Values, robot: RobotDescription, profile: Profile) -> ParameterEffects:
    """Return what values that `handed_over_parameters` has let through change."""
    effects = ParameterEffects()
    for name, apply in _APPLY.items():
        if name in given:
            apply(given, robot, effects)
    _remember(given, profile, effects)
    _plan_again(given, robot, effects)
    return effects


def holding(given: Values, robot: RobotDescription, profile: Profile) -> dict[str, Any]:
    """Return every parameter with the value that holds for this robot under this profile.

    The key is never among them. No model's name holds where the profile asks no server.
    """
    bounds, planning = robot.planning, profile.planning
    held: dict[str, Any] = {name: given.get(name, value) for name, value in _DEFAULTS.items()}
    held |= {
        "vlm_api_key": "",
        "max_replan_attempts": bounds.further_plans,
        "replan_on_failure": bounds.further_plans > 0,
        "plan_timeout": float(planning.within_s),
        "require_confirmation": bounds.require_confirmation is not Confirm.NEVER,
        "max_speed": float(robot.base.max_speed_m_s),
        "enable_memory": planning.remembered > 0,
        "max_memory_items": planning.remembered,
    }
    if bounds.action_timeout_s < math.inf:
        held["action_timeout"] = float(bounds.action_timeout_s)
    if not planning.servers:
        held |= {"vlm_model": "", "local_vlm_model": ""}
    zones = {zone.name for zone in robot.home.zones}
    places = spoken_places(robot.places)
    held["restricted_areas"] = [
        area
        for area in given.get("restricted_areas", ())
        if _zone_name(_place(area, places)) in zones
    ]
    return held


def _max_speed(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    asked_m_s, own_m_s = float(given["max_speed"]), robot.base.max_speed_m_s
    if asked_m_s > own_m_s:
        effects.notes.append(_no_more("max_speed", own_m_s, asked_m_s, "m/s"))
    elif asked_m_s < own_m_s:
        effects.robot["base"] = {"max_speed_m_s": asked_m_s}


def _require_confirmation(
    given: Values, robot: RobotDescription, effects: ParameterEffects
) -> None:
    own = robot.planning.require_confirmation
    wanted = Confirm.RISKY if given["require_confirmation"] else Confirm.NEVER
    if wanted is Confirm.RISKY and own is Confirm.ALWAYS:
        effects.notes.append(
            "require_confirmation: the robot file has every plan confirmed, not only risky ones"
        )
    elif wanted is not own:
        _planning(effects)["require_confirmation"] = wanted.value


def _action_timeout(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    asked_s, own_s = float(given["action_timeout"]), robot.planning.action_timeout_s
    if asked_s == _DEFAULTS["action_timeout"]:
        return  # each skill has a time-out that suits it
    if asked_s > own_s:
        effects.notes.append(_no_more("action_timeout", own_s, asked_s, "s"))
    else:
        _planning(effects)["action_timeout_s"] = asked_s


def _no_more(name: str, own: float, asked: float, unit: str) -> str:
    return f"{name}: {own:g} {unit} holds, not {asked:g}: the robot file allows no more"


def _plan_timeout(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    asked_s = float(given["plan_timeout"])
    within_s = min(max(asked_s, WITHIN_S[0]), WITHIN_S[1])
    if within_s != asked_s:
        effects.notes.append(
            f"plan_timeout: {within_s:g} s holds, not {asked_s:g}: "
            f"it may be {WITHIN_S[0]:g} to {WITHIN_S[1]:g} s"
        )
    effects.profile["within_s"] = within_s


def _planning_rate(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    if given["planning_rate"] != _DEFAULTS["planning_rate"]:
        effects.notes.append(
            f"planning_rate: {given['planning_rate']:g} Hz changes nothing: "
            "the planner acts when a command comes or a plan fails, at no rate"
        )


def _restricted_areas(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    places = spoken_places(robot.places)
    known = {area: _place(area, places) for area in given["restricted_areas"]}
    if unknown := [area for area, place in known.items() if place is None]:
        effects.notes.append(
            f"restricted_areas: no such place on the map, so nothing to keep out of: "
            f"{', '.join(unknown)}; places are {', '.join(robot.places)}"
        )
    zones = [_document(zone) for zone in robot.home.zones]
    taken = {zone["name"] for zone in zones}
    for area, name in known.items():
        if name is None or _zone_name(name) in taken:
            continue
        if _is_in_the_way_at_the_start(robot, robot.places[name]):
            effects.faults.append(
                f"restricted_areas: expected places away from {robot.home.start}, "
                f"where the robot starts, got {area!r}"
            )
            continue
        taken.add(_zone_name(name))
        zones.append(_square(robot.places[name]))
    if len(zones) > len(robot.home.zones):
        effects.robot["home"] = {"zones": zones}


def _remember(given: Values, profile: Profile, effects: ParameterEffects) -> None:
    own, default = profile.planning.remembered, _DEFAULTS["max_memory_items"]
    items = given.get("max_memory_items", default)
    if not given.get("enable_memory", True):
        remembered = 0
    elif items != default or (given.get("enable_memory") and own == 0):
        remembered = int(items)
    else:  # what is forgotten does not come back: the default file must not cut a memory short
        return
    if 0 < remembered < own:
        effects.notes.append(
            f"max_memory_items: of the commands remembered, all but the newest {remembered} "
            f"are forgotten; profile {profile.name} keeps {own}"
        )
    effects.profile["remembered"] = remembered


def _plan_again(given: Values, robot: RobotDescription, effects: ParameterEffects) -> None:
    own = robot.planning.further_plans
    further = int(given.get("max_replan_attempts", own))
    if not given.get("replan_on_failure", True):
        further = 0
    if further != own:
        _planning(effects)["further_plans"] = further


_APPLY: Final[Mapping[str, Callable[[Values, RobotDescription, ParameterEffects], None]]] = {
    "max_speed": _max_speed,
    "require_confirmation": _require_confirmation,
    "action_timeout": _action_timeout,
    "plan_timeout": _plan_timeout,
    "planning_rate": _planning_rate,
    "restricted_areas": _restricted_areas,
}


def _planning(effects: ParameterEffects) -> dict[str, Any]:
    return effects.robot.setdefault("planning", {})


def _place(area: str, places: Mapping[str, str]) -> str | None:
    return places.get(" ".join(words_of(area.replace("_", " "))))


def _zone_name(place: str | None) -> str:
    return f"{_AREA}{place}"


def _square(place: Place) -> dict[str, Any]:
    half_m = AREA_SIDE_M / 2
    corners = ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))
    polygon_m = [
        [round(place.pose.x_m + x_m, 3), round(place.pose.y_m + y_m, 3)] for x_m, y_m in corners
    ]
    return {"name": _zone_name(place.name), "reason": _REASON, "polygon_m": polygon_m}


def _document(zone: KeepOutZone) -> dict[str, Any]:
    polygon_m = [list(corner) for corner in zone.polygon_m]
    return {"name": zone.name, "reason": zone.reason, "polygon_m": polygon_m}


def _is_in_the_way_at_the_start(robot: RobotDescription, place: Place) -> bool:
    start, half_m = robot.places[robot.home.start].pose, AREA_SIDE_M / 2
    beyond_m = (
        max(abs(start.x_m - place.pose.x_m) - half_m, 0.0),
        max(abs(start.y_m - place.pose.y_m) - half_m, 0.0),
    )
    return math.hypot(*beyond_m) < robot.base.footprint_radius_m
