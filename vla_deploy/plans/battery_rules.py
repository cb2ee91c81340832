"""Decide what a low battery means for plans: which may run, what is said, what is begun; pure."""

from dataclasses import dataclass, replace
from enum import Enum, IntEnum
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc.payloads.supervision import BatteryDocument
from vla_deploy.plans.catalogue import MOTIONLESS
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots.battery_settings import AtLow, BatterySettings

AGAIN_NS: Final = 300 * NS_PER_S
"""How long after a plan to charge another one may be begun by the robot itself."""
_LETTING_GO: Final = frozenset({"open_gripper"})


class BatteryAct(Enum):
    """Name what the robot does about its battery; the value is what it says."""

    SAY_LOW = "My battery is low."
    SAY_CRITICAL = "My battery is nearly empty."
    END_PLANS = ""
    CHARGE = "I go to charge."


class _Urgency(IntEnum):
    NONE = 0
    LOW = 1
    CRITICAL = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotNow:
    """Say what of the robot the rules look at; `goes_on` is anything but going to charge."""

    may_move: bool
    is_idle: bool
    goes_on: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleState:
    """Hold what was said of this low battery, and when the robot last went to charge by itself."""

    told: _Urgency = _Urgency.NONE
    tried_ns: int | None = None


def acts_on(
    state: RuleState,
    battery: BatteryDocument | None,
    settings: BatterySettings,
    robot: RobotNow,
    now_ns: int,
) -> tuple[RuleState, tuple[BatteryAct, ...]]:
    """Return what to do now, and the state after it; a battery that is not known changes nothing.

    One that charges is no worry. At the critical ratio what goes on is ended, once.
    """
    if battery is None:
        return state, ()
    urgency = _urgency(battery)
    acts: list[BatteryAct] = []
    if urgency > state.told:
        is_critical = urgency is _Urgency.CRITICAL
        acts.append(BatteryAct.SAY_CRITICAL if is_critical else BatteryAct.SAY_LOW)
        if is_critical and robot.goes_on:
            acts.append(BatteryAct.END_PLANS)
    is_due = state.tried_ns is None or now_ns - state.tried_ns >= AGAIN_NS
    wants = urgency and settings.at_low is AtLow.CHARGE and bool(settings.station)
    if wants and is_due and robot.may_move and robot.is_idle:
        return RuleState(told=urgency, tried_ns=now_ns), (*acts, BatteryAct.CHARGE)
    return replace(state, told=urgency), tuple(acts)


def _urgency(battery: BatteryDocument) -> _Urgency:
    if battery["is_charging"]:
        return _Urgency.NONE
    if battery["critical"]:
        return _Urgency.CRITICAL
    return _Urgency.LOW if battery["low"] else _Urgency.NONE


def refusal_at_low(
    plan: Plan, battery: BatteryDocument | None, settings: BatterySettings | None
) -> str:
    """Return why a plan may not run on this battery, "" where it may."""
    if settings is None or battery is None or not battery["low"]:
        return ""
    if all(is_let_at_low(one, settings.station) for one in plan.actions):
        return ""
    charge = battery["charge_ratio"]
    told = "" if charge is None else f" ({100 * charge:.0f} %)"
    remedy = "; say: go and charge" if settings.station else "; charge it, or bring the robot to it"
    return f"the battery is low{told}, so I do nothing that moves but going to charge{remedy}"


def is_let_at_low(action: Action, station: str) -> bool:
    """Return whether an action may be done on a low battery: it moves nothing, or goes to charge.

    Letting go of a thing may be what a person waits for.
    """
    goes_there = bool(station) and action.parameters.get("place") == station
    return (
        action.skill in MOTIONLESS | _LETTING_GO
        or action.skill == "charge"
        or (action.skill == "navigate_to" and goes_there)
    )
