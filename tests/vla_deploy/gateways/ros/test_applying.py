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


def test_a_lower_speed_holds_and_a_higher_one_does_not(effects) -> None:
    assert effects(max_speed=0.2).robot == {"base": {"max_speed_m_s": 0.2}}
    faster = effects(max_speed=1.5)
    assert faster.robot == {}
    assert faster.notes == ["max_speed: 0.5 m/s holds, not 1.5: the robot file allows no more"]


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


def test_the_time_for_a_plan_is_kept_in_its_range(effects) -> None:
    assert effects(plan_timeout=12.0).profile == {"within_s": 12.0}
    for asked_s, within_s in ((0.2, 1.0), (600.0, 300.0)):
        told = effects(plan_timeout=asked_s)
        assert told.profile == {"within_s": within_s}
        assert told.notes == [
            f"plan_timeout: {within_s:g} s holds, not {asked_s:g}: it may be 1 to 300 s"
        ]


def test_the_time_for_an_action_at_its_default_leaves_each_skill_its_own(effects) -> None:
    assert effects(action_timeout=60.0) == ParameterEffects()
    assert effects(action_timeout=20.0).robot == {"planning": {"action_timeout_s": 20.0}}


def test_the_time_for_an_action_is_never_above_the_robots_own(butler, desktop) -> None:
    robot = replace(butler, planning=replace(butler.planning, action_timeout_s=30.0))
    told = effects_of({"action_timeout": 90.0}, robot, desktop)
    assert told.robot == {}
    assert told.notes[0].startswith("action_timeout: 30 s holds, not 90")


@pytest.mark.parametrize(
    ("given", "further_plans"),
    [
        ({"max_replan_attempts": 5}, 5),
        ({"max_replan_attempts": 0}, 0),
        ({"replan_on_failure": False}, 0),
        ({"replan_on_failure": False, "max_replan_attempts": 5}, 0),
        ({"replan_on_failure": True, "max_replan_attempts": 3}, None),
    ],
)
def test_further_plans(effects, given: dict[str, Any], further_plans: int | None) -> None:
    planning = effects(**given).robot.get("planning", {})
    assert planning.get("further_plans") == further_plans


@pytest.mark.parametrize(
    ("given", "remembered"),
    [
        ({"enable_memory": False}, 0),
        ({"enable_memory": False, "max_memory_items": 10}, 0),
        ({"enable_memory": True}, None),
        ({"enable_memory": True, "max_memory_items": 10}, 10),
        ({"max_memory_items": 9000}, 9000),
    ],
)
def test_memory(effects, given: dict[str, Any], remembered: int | None) -> None:
    assert effects(**given).profile.get("remembered") == remembered


def test_memory_is_switched_on_where_the_profile_has_none(butler, desktop) -> None:
    profile = replace(desktop, planning=replace(desktop.planning, remembered=0))
    assert effects_of({"enable_memory": True}, butler, profile).profile == {"remembered": 100}


def test_a_rate_of_planning_changes_nothing_and_says_so(effects) -> None:
    assert effects(planning_rate=1.0) == ParameterEffects()
    told = effects(planning_rate=5.0)
    assert (told.robot, told.profile) == ({}, {})
    assert told.notes[0].startswith("planning_rate: 5 Hz changes nothing")


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
