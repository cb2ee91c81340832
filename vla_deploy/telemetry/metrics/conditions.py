"""Declare what is wrong when: one table for Prometheus' alerts and for ROS 2 diagnostics."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from vla_deploy.telemetry.metrics.kinds import Metric, Point
from vla_deploy.telemetry.metrics.table import METRICS_BY_NAME

_STATES: Final = "state"


class Severity(IntEnum):
    """Order how bad something is; the numbers are the levels of diagnostic_msgs."""

    WARNING = 1
    CRITICAL = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Call it wrong when a metric is beyond a limit for `for_s`.

    `where` names label values, one of which each label must have. With `per_s` it is about what a
    counter gains per second over that time, or, with `of`, for each that the counter `of` gains.
    """

    name: str
    severity: Severity
    metric: str
    summary: str
    remedy: str
    above: float | None = None
    below: float | None = None
    for_s: int = 0
    where: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    per_s: int = 0
    of: str = ""

    def holds(self, point: Point) -> bool:
        """Tell whether a value is beyond the limit; one look knows no counter's gain."""
        if self.per_s or not isinstance(point.value, float):
            return False
        labels = dict(zip(self.declared.labels, point.labels, strict=True))
        if any(labels[label] not in values for label, values in self.where.items()):
            return False
        if self.above is not None:
            return point.value > self.above
        return self.below is not None and point.value < self.below

    @property
    def declared(self) -> Metric:
        """Return the metric that it is about."""
        return METRICS_BY_NAME[self.metric]


_WARNING: Final = Severity.WARNING
_CRITICAL: Final = Severity.CRITICAL


def _state(
    name: str, severity: Severity, metric: str, states: tuple[str, ...], *texts: str, for_s: int = 0
) -> Condition:
    """Declare that some states of a metric are wrong."""
    summary, remedy = texts
    label = METRICS_BY_NAME[metric].state_label
    return Condition(
        name=name,
        severity=severity,
        metric=metric,
        where={label: states},
        above=0.0,
        for_s=for_s,
        summary=summary,
        remedy=remedy,
    )


def _above(
    name: str, severity: Severity, metric: str, limit: float, *texts: str, for_s: int = 0
) -> Condition:
    """Declare that too much of a gauge is wrong."""
    summary, remedy = texts
    return Condition(
        name=name,
        severity=severity,
        metric=metric,
        above=limit,
        for_s=for_s,
        summary=summary,
        remedy=remedy,
    )


CONDITIONS: Final[tuple[Condition, ...]] = (
    _above(
        *("VlaEstopLatched", _WARNING, "vla_estop_latched", 0.0),
        *("The emergency stop is latched.", "See why, then: vla-deploy reset, vla-deploy arm"),
    ),
    _state(
        *("VlaSafetyStop", _WARNING, "vla_safety_reaction"),
        ("protective_stop", "hold", "base_off", "group_stop"),
        *("A safety rule has stopped the robot.", "vla-deploy status names cause and limit"),
        for_s=10,
    ),
    _state(
        *("VlaControlFault", _CRITICAL, "vla_control_state", ("fault",)),
        *("Control cannot be armed.", "vla-deploy status names the cause"),
        for_s=10,
    ),
    Condition(
        name="VlaLateTicks",
        severity=_WARNING,
        metric="vla_control_late_ticks_total",
        of="vla_control_ticks_total",
        per_s=60,
        above=0.01,
        for_s=60,
        summary="More than 1 % of control's ticks come late.",
        remedy="vla-deploy doctor says what keeps control from its priority",
    ),
    _state(
        *("VlaProcessGivenUp", _CRITICAL, "vla_process_state", ("given up",)),
        *("A process has failed too often and is given up.", "vla-deploy logs, vla-deploy crashes"),
    ),
    Condition(
        name="VlaProcessRestarts",
        severity=_WARNING,
        metric="vla_process_restarts_total",
        per_s=600,
        above=0.003,
        summary="A process is started again and again.",
        remedy="vla-deploy crashes",
    ),
    _above(
        *("VlaTopicsLate", _WARNING, "vla_process_alarms", 0.0),
        *("A process' topics are too old, too slow or not valid.", "vla-deploy status"),
        for_s=10,
    ),
    Condition(
        name="VlaCommandsRefused",
        severity=_CRITICAL,
        metric="vla_commands_taken",
        below=1.0,
        for_s=5,
        summary="The robot takes no commands.",
        remedy="vla-deploy status says why",
    ),
    _above(
        *("VlaBudgetBroken", _WARNING, "vla_budget_over", 0.0),
        *("A budget is broken.", "vla-deploy budget shows the line and what is done about it"),
        for_s=30,
    ),
    _above(
        *("VlaBudgetStop", _CRITICAL, "vla_budget_stop", 0.0),
        *("A budget has stopped the robot.", "vla-deploy budget says which"),
    ),
    _state(
        *("VlaBusDegraded", _WARNING, "vla_bus_state", ("degraded",)),
        *("A servo bus loses answers.", "Look at cable, connectors and supply"),
        for_s=30,
    ),
    _state(
        *("VlaBusLost", _CRITICAL, "vla_bus_state", ("lost",)),
        *("A servo bus has used up its error budget.", "Look at cable, connectors and supply"),
    ),
    Condition(
        name="VlaBusFaults",
        severity=_WARNING,
        metric="vla_bus_faults_total",
        per_s=60,
        above=1.0,
        for_s=60,
        summary="Something goes wrong on a bus more than once a second.",
        remedy="vla-deploy status --json has the counters; look at the wiring",
    ),
    _above(
        *("VlaJointWarm", _WARNING, "vla_joint_temperature_celsius", 65.0),
        *("A joint's servo is warm.", "Let it rest, or give it less to hold"),
        for_s=60,
    ),
    _above(
        *("VlaJointError", _CRITICAL, "vla_joint_hardware_error", 0.0),
        *("A joint's servo reports a hardware error.", "vla-deploy servo monitor; then reset"),
    ),
    _above(
        *("VlaComputerHot", _WARNING, "vla_temperature_celsius", 85.0),
        *("The computer is hot.", "Look at fan and airflow; vla-deploy budget"),
        for_s=60,
    ),
    Condition(
        name="VlaPowerFault",
        severity=_CRITICAL,
        metric="vla_throttle_events_total",
        where={"kind": ("oc1", "oc2")},
        per_s=60,
        above=0.0,
        summary="The supply of the computer fails: under-voltage or average over-current.",
        remedy="Look at battery, cable and power mode",
    ),
    Condition(
        name="VlaDiskNearlyFull",
        severity=_WARNING,
        metric="vla_disk_free_ratio",
        below=0.05,
        for_s=60,
        summary="A disk that the robot writes to is nearly full.",
        remedy="Make room; the robot's own logs and recordings are bounded",
    ),
    _state(
        *("VlaPlaceLost", _WARNING, "vla_place_state", ("lost",)),
        *("The robot does not know where it is.", "vla-deploy status says why"),
        for_s=10,
    ),
    _above(
        *("VlaSensorAway", _WARNING, "vla_perception_sensors_away", 0.0),
        *("A sensor gives nothing.", "vla-deploy doctor"),
        for_s=10,
    ),
    _state(
        *("VlaSightByForm", _WARNING, "vla_perception_sight", ("form",)),
        *("The robot names things without its network.", "vla-deploy status says why"),
        for_s=60,
    ),
)
