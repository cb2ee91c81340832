"""Type what moves the robot and what control reports."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NotRequired, TypedDict

OperatorActName = Literal["estop", "reset", "arm", "disarm"]
MotionStatusName = Literal["done", "touched", "cancelled", "refused", "stopped"]
ControlStateName = Literal["disarmed", "armed", "stopping", "protective_stop", "stopped", "fault"]
StopStateName = Literal["in_progress", "verified", "failed"]


class OperatorRequest(TypedDict):
    """Ask control for an act; `source` is shown as who asked."""

    act: OperatorActName
    source: str
    reason: str


class GoalMotion(TypedDict):
    """Bring joints to targets (rad, or m for a finger): time-optimal, jerk-limited, together.

    Where `together` is false each joint arrives as early as it can. Like a trajectory it takes over
    the joints that it names; a motion that loses any of its joints ends as cancelled. Ratios are
    above 0 and at most 1, the effort's by joint.
    """

    kind: Literal["goal"]
    motion_id: int
    targets: dict[str, float]
    speed_ratio: float
    effort_ratio: NotRequired[dict[str, float]]
    together: NotRequired[bool]


class TrajectoryMotion(TypedDict):
    """Pass timed positions (times, joints), cubic in between, from the present setpoint on.

    With a `contact_ratio` it feels its way: a torque that grows by this share of a joint's contact
    limit since it began ends it as touched, and its joints ramp to rest.
    """

    kind: Literal["trajectory"]
    motion_id: int
    joints: list[str]
    times_s: list[float]
    positions: list[list[float]]
    contact_ratio: NotRequired[float]


class CancelMotion(TypedDict):
    """Ramp a motion to rest."""

    kind: Literal["cancel"]
    motion_id: int


class RestNotice(TypedDict):
    """Say that all that the sender moves comes to rest now, so that control verifies it.

    It follows the cancels of its motions, and ends nothing itself. `source` is who asked.
    """

    kind: Literal["rest"]
    motion_id: int
    source: str


MotionCommand = GoalMotion | TrajectoryMotion | CancelMotion | RestNotice


class MotionEnd(TypedDict):
    """Say how a motion ended, and why."""

    motion_id: int
    status: MotionStatusName
    reason: str


class VerdictFields(TypedDict):
    """Say who stops or slows the robot and by which numbers; null where none applies."""

    cause: str
    reaction: str
    subject: str
    measured: float | None
    limit: float | None
    age_s: float | None
    speed_ratio: float
    blocked: list[str]


class TickPeriodCounts(TypedDict):
    """Count tick periods over the nominal one; the last count is beyond all bounds in `le`."""

    le: Sequence[float]
    counts: list[int]
    sum: float


class JointReadings(TypedDict):
    """Hold what servos report slowly, in joint order; null was not read yet."""

    temperature_c: list[float | None]
    voltage_v: list[float | None]


class StopRecord(TypedDict):
    """Say whether a stop was verified, by control's own measurements.

    `cause` is one of the safety rules, or `stop` of an operator; `source` who or what it was.
    `category` is the lowest of IEC 60204-1 by which a part stops. `standstill_s` counts from
    `begun_ns` of the run's clock, null until verified; `allowed_s` is the most it may be. `reason`
    says which part moved on, or was not measured, where the stop failed.
    """

    number: int
    state: StopStateName
    cause: str
    source: str
    category: int
    begun_ns: int
    age_s: float
    allowed_s: float
    standstill_s: float | None
    reason: str


class ControlStatus(VerdictFields):
    """Hold control's state, verdict in force, last stop, tick statistics, each bus' counters."""

    state: ControlStateName
    estop_latched: bool
    detail: str
    never_moves: str
    tick: int
    judged_tick: int
    late_ticks: int
    period_s: float
    nominal_period_s: float
    period_ratio: TickPeriodCounts
    buses: dict[str, Mapping[str, Any]]
    joints: JointReadings
    active_motions: list[int]
    last_stop: StopRecord | None
