"""What a low battery lets run, what the robot says of it, and when it goes to charge by itself."""

from dataclasses import replace
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.plans.battery_rules import (
    AGAIN_NS,
    BatteryAct,
    RobotNow,
    RuleState,
    acts_on,
    refusal_at_low,
)
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots.battery_settings import AtLow, BatterySettings, BatterySource

ANNOUNCES = BatterySettings(
    source=BatterySource.POWER_SUPPLY, capacity_wh=240.0, cells=7, station="charging_station"
)
CHARGES = replace(ANNOUNCES, at_low=AtLow.CHARGE)
IDLE = RobotNow(may_move=True, is_idle=True, goes_on=False)
AT_WORK = RobotNow(may_move=True, is_idle=False, goes_on=True)
ON_ITS_WAY = RobotNow(may_move=True, is_idle=False, goes_on=False)
STOPPED = replace(IDLE, may_move=False)
LOW, CRITICAL, END, GO = (
    *(BatteryAct.SAY_LOW, BatteryAct.SAY_CRITICAL),
    *(BatteryAct.END_PLANS, BatteryAct.CHARGE),
)


def battery(charge: float | None = 0.2, **changes: Any) -> BatteryDocument:
    told: BatteryDocument = {
        "source": "power_supply",
        "stamp_ns": 0,
        "voltage_v": 25.0,
        "charge_ratio": charge,
        "is_estimate": False,
        "current_a": -1.0,
        "is_charging": False,
        "low": True,
        "critical": False,
        "missing": {},
    }
    return {**told, **changes}  # type: ignore[typeddict-item]


FULL = battery(0.9, low=False)
EMPTY = battery(0.05, critical=True)
CHARGING = battery(is_charging=True)
Look = tuple[BatteryDocument | None, RobotNow, float, tuple[BatteryAct, ...]]


@pytest.mark.parametrize(
    ("settings", "looks"),
    [
        (ANNOUNCES, [(FULL, IDLE, 0, ()), (battery(), IDLE, 1, (LOW,)), (battery(), IDLE, 2, ())]),
        (ANNOUNCES, [(battery(), AT_WORK, 0, (LOW,)), (EMPTY, AT_WORK, 1, (CRITICAL, END)),
                     (EMPTY, AT_WORK, 2, ())]),
        (ANNOUNCES, [(EMPTY, ON_ITS_WAY, 0, (CRITICAL,))]),
        (ANNOUNCES, [(battery(), IDLE, 0, (LOW,)), (None, IDLE, 1, ()), (battery(), IDLE, 2, ())]),
        (ANNOUNCES, [(CHARGING, IDLE, 0, ()), (battery(), IDLE, 1, (LOW,))]),
        (CHARGES, [(battery(), IDLE, 0, (LOW, GO)), (battery(), ON_ITS_WAY, 1, ()),
                   (CHARGING, IDLE, 2, ())]),
        (CHARGES, [(battery(), AT_WORK, 0, (LOW,)), (battery(), IDLE, 1, (GO,))]),
        (CHARGES, [(EMPTY, AT_WORK, 0, (CRITICAL, END)), (EMPTY, IDLE, 1, (GO,))]),
        # Neither an emergency stop nor a disarmed robot is overruled; armed again, it goes.
        (CHARGES, [(battery(), STOPPED, 0, (LOW,)), (battery(), STOPPED, 9, ()),
                   (battery(), IDLE, 10, (GO,))]),
        # One that failed is tried again, but not at once.
        (CHARGES, [(battery(), IDLE, 0, (LOW, GO)), (battery(), IDLE, AGAIN_NS / NS_PER_S - 1, ()),
                   (battery(), IDLE, AGAIN_NS / NS_PER_S, (GO,))]),
        (replace(CHARGES, station=""), [(battery(), IDLE, 0, (LOW,))]),
    ],
)  # fmt: skip
def test_what_the_robot_does_about_its_battery(
    settings: BatterySettings, looks: list[Look]
) -> None:
    state = RuleState()
    for told, robot, at_s, expected in looks:
        state, acts = acts_on(state, told, settings, robot, round(at_s * NS_PER_S))
        assert acts == expected, at_s


@pytest.mark.parametrize(
    ("skills", "runs"),
    [
        ([("charge", {"place": "charging_station"})], True),
        ([("navigate_to", {"place": "charging_station"})], True),
        ([("speak", {"text": "My battery is low."}), ("stop", {})], True),
        ([("open_gripper", {})], True),
        ([("navigate_to", {"place": "kitchen"})], False),
        ([("charge", {}), ("pick_up", {"object": "cup"})], False),
        ([("turn", {"angle_rad": 1.0})], False),
    ],
)
def test_a_low_battery_lets_run_what_moves_nothing_or_goes_to_charge(
    skills: list[tuple[str, dict[str, Any]]], runs: bool
) -> None:
    actions = tuple(
        Action(id=f"a{n}", skill=skill, parameters=given) for n, (skill, given) in enumerate(skills)
    )
    plan = Plan(goal="something", actions=actions)
    assert refusal_at_low(plan, FULL, ANNOUNCES) == ""
    assert refusal_at_low(plan, None, ANNOUNCES) == ""
    assert refusal_at_low(plan, battery(), None) == ""
    refusal = refusal_at_low(plan, battery(), ANNOUNCES)
    assert (refusal == "") is runs
    assert runs or "the battery is low (20 %)" in refusal
