"""Find why control stops or slows the robot, and whether control itself keeps time."""

from collections.abc import Iterator, Mapping
from typing import Final

from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Document, Told
from vla_deploy.safety import Cause, Reaction
from vla_deploy.safety.causes import RULES

BY_REACTION: Final[Mapping[Reaction, Severity]] = {
    Reaction.NONE: Severity.INFO,
    Reaction.BASE_SLOW: Severity.INFO,
    Reaction.BASE_BLOCK: Severity.INFO,
    Reaction.BASE_RAMP: Severity.WARNING,
    Reaction.PROTECTIVE_STOP: Severity.WARNING,
    Reaction.HOLD: Severity.ERROR,
    Reaction.BASE_OFF: Severity.ERROR,
    Reaction.GROUP_STOP: Severity.ERROR,
}
UNITS: Final[Mapping[Cause, str]] = {
    Cause.STANDSTILL_MOTION: "rad/s",
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
"""Units of what each cause measures; fingers, which slide, are in metres where joints turn."""
LATE_RATIO: Final = 0.2
UNJUDGED_TICKS: Final = 2
_ADVICE: Final = {rule.cause: rule.advice for rule in RULES}
_LATE_RISE_S: Final = 5.0


def active_cause(told: Told) -> Iterator[Finding]:
    """Find what safety reports: the cause that wins over all others."""
    status = told.document("control_status")
    if status is None:
        return
    if status["cause"]:
        yield _of_cause(status)
    elif status["state"] == "fault":
        yield Finding(
            process="control",
            field="state",
            text=f"control cannot be armed: {status['detail'] or 'no reason given'}",
            severity=Severity.ERROR,
            advice="remove the cause, then: vla-deploy reset",
            rise_s=0.0,
        )


def untimely_control(told: Told) -> Iterator[Finding]:
    """Find a control that ticks late, or that safety does not judge."""
    status = told.document("control_status")
    if told.late_ratio is not None and told.late_ratio > LATE_RATIO:
        yield Finding(
            process="control",
            field="late_ticks",
            text="control's ticks come late",
            severity=Severity.WARNING,
            advice="grant SCHED_FIFO (vla-deploy doctor), or give the computer less to do",
            measured=round(told.late_ratio, 3),
            limit=LATE_RATIO,
            unit="of all ticks",
            rise_s=_LATE_RISE_S,
        )
    unjudged = 0 if status is None else int(status["tick"]) - int(status["judged_tick"])
    if unjudged > UNJUDGED_TICKS:
        yield Finding(
            process="control",
            field="judged_tick",
            text="ticks go by that safety has not judged",
            severity=Severity.CRITICAL,
            advice="stop the robot, then look into: vla-deploy logs control",
            measured=float(unjudged),
            limit=float(UNJUDGED_TICKS),
            unit="ticks",
        )


def _of_cause(status: Document) -> Finding:
    cause = Cause(status["cause"])
    whose = f" ({status['subject']})" if status["subject"] else ""
    return Finding(
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
