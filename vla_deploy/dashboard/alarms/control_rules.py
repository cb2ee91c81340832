"""Find why control stops or slows the robot, late ticks, and faulty buses."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.robot_status import Document, RobotStatus
from vla_deploy.safety import Cause, Reaction
from vla_deploy.safety.causes import RULES

BY_REACTION: Final[Mapping[Reaction, AlarmSeverity]] = {
    Reaction.NONE: AlarmSeverity.INFO,
    Reaction.BASE_SLOW: AlarmSeverity.INFO,
    Reaction.BASE_BLOCK: AlarmSeverity.INFO,
    Reaction.BASE_RAMP: AlarmSeverity.WARNING,
    Reaction.PROTECTIVE_STOP: AlarmSeverity.WARNING,
    Reaction.HOLD: AlarmSeverity.ERROR,
    Reaction.BASE_OFF: AlarmSeverity.ERROR,
    Reaction.GROUP_STOP: AlarmSeverity.ERROR,
}
UNITS: Final[Mapping[Cause, str]] = {
    Cause.STANDSTILL_MOTION: "rad/s",
    Cause.TIP_MARGIN: "",
    Cause.SERVO_BUS_LOST: "s",
    Cause.CAN_BUS_LOST: "s",
    Cause.SERVO_HARDWARE_ERROR: "(error bits)",
    Cause.DRIVE_FAULT: "(fault code)",
    Cause.SERVO_WATCHDOG_TRIPPED: "(servos)",
    Cause.JOINT_UNPOWERED: "(joints)",
    Cause.ENCODER_JUMP: "rad",
    Cause.JOINT_POSITION_LIMIT: "rad",
    Cause.JOINT_VELOCITY_LIMIT: "rad/s",
    Cause.FOLLOWING_ERROR: "rad",
    Cause.WHEEL_FOLLOWING_ERROR: "rad/s",
    Cause.JOINT_CURRENT_LIMIT: "of stall current",
    Cause.JOINT_TEMPERATURE_LIMIT: "°C",
    Cause.COLLISION: "N·m",
    Cause.SUPERVISOR_LOST: "s",
    Cause.JOINT_VOLTAGE_LIMIT: "V",
    Cause.SELF_COLLISION: "m",
    Cause.ENVIRONMENT_COLLISION: "m",
    Cause.WORKSPACE: "m",
    Cause.TIP_OVER: "of the margin",
    Cause.STALE_SCAN: "s",
    Cause.STALE_DEPTH: "s",
    Cause.STALE_POSE: "s",
    Cause.STALE_IMU: "s",
    Cause.STALE_COMMAND: "s",
    Cause.KEEP_OUT_ZONE: "m",
    Cause.OBSTACLE_STOP_ZONE: "m",
    Cause.OBSTACLE_SLOW_ZONE: "m",
    Cause.OBSTACLE_LIMIT_ZONE: "m",
    Cause.OBSTACLE_APPROACH: "s",
}
"""The unit that each cause measures; for sliding fingers read metres in place of radians."""
LATE_RATIO: Final = 0.2
UNJUDGED_TICKS: Final = 2
_ADVICE: Final = {rule.cause: rule.advice for rule in RULES}
_LATE_RISE_S: Final = 5.0
_CABLE: Final = "check cable, termination and the device's power"
_SHOWN: Final = 4
_SERVOS: Final = {
    "lost": ("has lost", AlarmSeverity.ERROR),
    "degraded": ("gets too few answers of", AlarmSeverity.WARNING),
}
_NODES: Final = {
    "lost_nodes": ("has lost nodes", AlarmSeverity.ERROR),
    "degraded_nodes": ("has nodes that answer badly", AlarmSeverity.WARNING),
    "bus_degraded": ("carries damaged frames", AlarmSeverity.WARNING),
}
"""Counters of a CAN bus that are zero in normal operation."""


def active_cause(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find the cause that safety reports, which has priority over all others."""
    status = robot.document("control_status")
    if status is None:
        return
    if status["cause"]:
        yield _of_cause(status)
    elif status["state"] == "fault":
        yield AlarmFinding(
            process="control",
            field="state",
            text=f"control cannot be armed: {status['detail'] or 'no reason given'}",
            severity=AlarmSeverity.ERROR,
            advice="remove the cause, then: vla-deploy reset",
            rise_s=0.0,
        )


def untimely_control(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find late ticks, and ticks that safety does not judge."""
    status = robot.document("control_status")
    if robot.late_ratio is not None and robot.late_ratio > LATE_RATIO:
        yield AlarmFinding(
            process="control",
            field="late_ticks",
            text="control's ticks come late",
            severity=AlarmSeverity.WARNING,
            advice="grant SCHED_FIFO (vla-deploy doctor), or give the computer less to do",
            measured=round(robot.late_ratio, 3),
            limit=LATE_RATIO,
            unit="of all ticks",
            rise_s=_LATE_RISE_S,
        )
    unjudged = 0 if status is None else int(status["tick"]) - int(status["judged_tick"])
    if unjudged > UNJUDGED_TICKS:
        yield AlarmFinding(
            process="control",
            field="judged_tick",
            text="ticks go by that safety has not judged",
            severity=AlarmSeverity.CRITICAL,
            advice="stop the robot, then look into: vla-deploy logs control",
            measured=float(unjudged),
            limit=float(UNJUDGED_TICKS),
            unit="ticks",
        )


def _of_cause(status: Document) -> AlarmFinding:
    cause = Cause(status["cause"])
    whose = f" ({status['subject']})" if status["subject"] else ""
    return AlarmFinding(
        process="control",
        field=cause.value,
        subject=status["subject"],
        text=f"{cause.value.replace('_', ' ')}{whose}: control is {status['state']}",
        severity=BY_REACTION[Reaction[status["reaction"].upper()]],
        advice=_ADVICE.get(cause, "see: vla-deploy status"),
        measured=status["measured"],
        limit=status["limit"],
        unit=UNITS.get(cause, ""),
        age_s=status["age_s"],
        rise_s=0.0,
    )


def troubled_buses(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find the faults that each bus counts.

    None while the emergency stop is latched: the button may cut the power of the devices.
    """
    status = robot.document("control_status")
    if status is None or status["estop_latched"]:
        return
    for name, counters in status["buses"].items():
        if not counters:
            text = f"bus {name} is not open"
            yield _found(name, text, AlarmSeverity.ERROR, robot)
            continue
        yield from _budget(name, counters.get("budget", {}), robot)
        yield from _nodes(name, counters, robot)


def _budget(name: str, budget: Document, robot: RobotStatus) -> Iterator[AlarmFinding]:
    if budget.get("bus") == "lost":
        text = f"bus {name} is lost: too many answers missing or damaged"
        yield _found(name, text, AlarmSeverity.ERROR, robot)
    elif budget.get("bus") == "degraded":
        text = f"bus {name} is degraded: answers go missing"
        yield _found(name, text, AlarmSeverity.WARNING, robot)
    for standing, (words, severity) in _SERVOS.items():
        joints = budget.get(standing, ())
        if joints:
            text = f"bus {name} {words}: {_listed(joints)}"
            yield _found(f"{name}.{standing}", text, severity, robot, count=len(joints))


def _nodes(name: str, counters: Document, robot: RobotStatus) -> Iterator[AlarmFinding]:
    for counter, (words, severity) in _NODES.items():
        count = int(counters.get(counter, 0))
        if count:
            yield _found(f"{name}.{counter}", f"bus {name} {words}", severity, robot, count=count)


def _found(
    field: str, text: str, severity: AlarmSeverity, robot: RobotStatus, count: int | None = None
) -> AlarmFinding:
    return AlarmFinding(
        process="control",
        field=f"buses.{field}",
        text=text,
        severity=severity,
        advice=_CABLE,
        measured=None if count is None else float(count),
        limit=None if count is None else 0.0,
        age_s=robot.age_s("control_status"),
    )


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")
