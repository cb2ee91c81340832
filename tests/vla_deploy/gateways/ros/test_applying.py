"""Each parameter changes what it is about; nothing gets faster than the robot file allows."""

from dataclasses import replace
from typing import Any

import pytest

from platforms import Profile, load_profile
from vla_deploy.gateways.ros.applying import ParameterEffects, effects_of, holding
from vla_deploy.gateways.ros.parameters import PARAMETERS
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.plan_bounds import Confirm

DEFAULTS = {one.name: one.default for one in PARAMETERS}
NO_MORE = "the robot file allows no more"
WITHIN = "plan_timeout: {:g} s holds, not {:g}: it may be 1 to 300 s"
AT_NO_RATE = (
    "planning_rate: 5 Hz changes nothing: "
    "the planner acts when a command comes or a plan fails, at no rate"
)
CUT = (
    "max_memory_items: of the commands remembered, all but the newest 10 are forgotten; "
    "profile desktop keeps 5000"
)
STAIRS = (
    "restricted_areas: no such place on the map, so nothing to keep out of: stairs, outside; places"
)


@pytest.fixture(scope="module")
def butler() -> RobotDescription:
    return load_robot("butler")


@pytest.fixture(scope="module")
def desktop() -> Profile:
    return load_profile("desktop")


@pytest.fixture
def effects(butler, desktop):
    return lambda **given: effects_of(given, butler, desktop)


def test_nothing_given_changes_nothing(effects) -> None:
    assert effects() == ParameterEffects()


def test_the_defaults_change_times_only_and_forget_nothing(effects) -> None:
    told = effects(**DEFAULTS)
    assert told.robot == {}
    assert told.profile == {"within_s": 30.0}
    assert told.faults == []
    (note,) = told.notes
    assert note.startswith(STAIRS)
    assert "all but the newest 99 are forgotten" in effects(max_memory_items=99).notes[0]


def changed(*notes: str, profile: dict[str, Any] | None = None, **robot: Any) -> ParameterEffects:
    return ParameterEffects(robot=robot, profile=profile or {}, notes=list(notes))


def plans(further: int) -> ParameterEffects:
    return changed(planning={"further_plans": further})


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"max_speed": 0.2}, changed(base={"max_speed_m_s": 0.2})),
        ({"max_speed": 1.5}, changed(f"max_speed: 0.5 m/s holds, not 1.5: {NO_MORE}")),
        ({"plan_timeout": 12.0}, changed(profile={"within_s": 12.0})),
        ({"plan_timeout": 0.2}, changed(WITHIN.format(1, 0.2), profile={"within_s": 1.0})),
        ({"plan_timeout": 600.0}, changed(WITHIN.format(300, 600), profile={"within_s": 300.0})),
        ({"action_timeout": 60.0}, changed()),  # the default leaves each skill its own
        ({"action_timeout": 20.0}, changed(planning={"action_timeout_s": 20.0})),
        ({"planning_rate": 1.0}, changed()),
        ({"planning_rate": 5.0}, changed(AT_NO_RATE)),
        ({"max_replan_attempts": 5}, plans(5)),
        ({"max_replan_attempts": 0}, plans(0)),
        ({"replan_on_failure": False}, plans(0)),
        ({"replan_on_failure": False, "max_replan_attempts": 5}, plans(0)),
        ({"replan_on_failure": True, "max_replan_attempts": 3}, changed()),
        ({"enable_memory": False}, changed(profile={"remembered": 0})),
        ({"enable_memory": False, "max_memory_items": 10}, changed(profile={"remembered": 0})),
        ({"enable_memory": True}, changed()),
        ({"enable_memory": True, "max_memory_items": 10}, changed(CUT, profile={"remembered": 10})),
        ({"max_memory_items": 9000}, changed(profile={"remembered": 9000})),
    ],
)
def test_each_changes_what_it_is_about(effects, given, expected) -> None:
    assert effects(**given) == expected


def test_confirmation_is_of_risky_plans_or_of_none(effects, butler, desktop) -> None:
    assert effects(require_confirmation=True).robot == {}
    never = {"planning": {"require_confirmation": "never"}}
    assert effects(require_confirmation=False).robot == never
    for own, changed in ((Confirm.NEVER, "risky"), (Confirm.ALWAYS, None)):
        robot = replace(butler, planning=replace(butler.planning, require_confirmation=own))
        told = effects_of({"require_confirmation": True}, robot, desktop)
        assert told.robot.get("planning", {}).get("require_confirmation") == changed
        assert bool(told.notes) == (own is Confirm.ALWAYS)


def test_a_restricted_place_becomes_a_zone_beside_the_robots_own(effects, butler) -> None:
    told = effects(restricted_areas=["Sofa-Table", "coffee_table", "stairs", "outside"])
    own, added = told.robot["home"]["zones"]
    assert own["name"] == butler.home.zones[0].name
    assert own["polygon_m"] == [list(corner) for corner in butler.home.zones[0].polygon_m]
    assert added["name"] == "restricted_area_of_coffee_table"
    assert added["polygon_m"] == [[1.9, 1.75], [2.5, 1.75], [2.5, 2.35], [1.9, 2.35]]
    assert [note[: len(STAIRS)] for note in told.notes] == [STAIRS]


def test_where_the_robot_starts_cannot_be_restricted(effects) -> None:
    told = effects(restricted_areas=["kitchen", "dock"])
    assert told.faults == [
        "restricted_areas: expected places away from charging_station, where the robot starts, "
        "got 'dock'"
    ]
    assert len(told.robot["home"]["zones"]) == 2


def test_the_time_for_an_action_is_never_above_the_robots_own(butler, desktop) -> None:
    robot = replace(butler, planning=replace(butler.planning, action_timeout_s=30.0))
    told = effects_of({"action_timeout": 90.0}, robot, desktop)
    assert told.robot == {}
    assert told.notes[0].startswith("action_timeout: 30 s holds, not 90")


def test_memory_is_switched_on_where_the_profile_has_none(butler, desktop) -> None:
    profile = replace(desktop, planning=replace(desktop.planning, remembered=0))
    assert effects_of({"enable_memory": True}, butler, profile).profile == {"remembered": 100}


def test_what_holds_is_told_for_every_parameter_and_never_the_key(butler, desktop) -> None:
    given = {"restricted_areas": ["kitchen"], "max_speed": 3.0, "vlm_api_key": "secret"}
    held = holding(given, butler, desktop)
    assert set(held) == set(DEFAULTS)
    wrong = [one.name for one in PARAMETERS if type(held[one.name]) is not type(one.default)]
    assert wrong == []
    assert held["max_speed"] == 0.5
    assert held["max_memory_items"] == 5000
    assert held["vlm_api_key"] == held["local_vlm_model"] == ""
    assert held["restricted_areas"] == []  # no zone, so nothing holds
