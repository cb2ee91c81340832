"""Declare the alert conditions: one table for Prometheus' alerts and for ROS 2 diagnostics."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from enum import IntEnum
from typing import Final

from vla_deploy.telemetry.metrics.metric import Metric, Point
from vla_deploy.telemetry.metrics.table import METRICS_BY_NAME


class AlertSeverity(IntEnum):
    """Order the severities; the numbers are the levels of diagnostic_msgs."""

    WARNING = 1
    CRITICAL = 2


@dataclass(frozen=True, slots=True)
class AlertCondition:
    """Declare that a metric beyond a limit for `for_s` is an alert.

    `where` lists for a label the values that count. With `per_s` the condition is about the rate
    of a counter over that time or, with `of`, about its rate relative to that of the counter `of`.
    """

    name: str
    severity: AlertSeverity
    metric: str
    summary: str
    remedy: str
    _: KW_ONLY
    above: float | None = 0.0
    below: float | None = None
    for_s: int = 0
    where: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    per_s: int = 0
    of: str = ""

    def holds(self, point: Point) -> bool:
        """Return whether a value is beyond the limit; never for a rate, as one value has none."""
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


_WARNING: Final = AlertSeverity.WARNING
_CRITICAL: Final = AlertSeverity.CRITICAL


CONDITIONS: Final[tuple[AlertCondition, ...]] = (
    AlertCondition(
        *("VlaEstopLatched", _WARNING, "vla_estop_latched"),
        *("The emergency stop is latched.", "See why, then: vla-deploy reset, vla-deploy arm"),
    ),
    AlertCondition(
        *("VlaSafetyStop", _WARNING, "vla_safety_reaction"),
        *("A safety rule has stopped the robot.", "vla-deploy status names cause and limit"),
        where={"reaction": ("protective_stop", "hold", "base_off", "group_stop")},
        for_s=10,
    ),
    AlertCondition(
        *("VlaControlFault", _CRITICAL, "vla_control_state"),
        *("Control cannot be armed.", "vla-deploy status names the cause"),
        where={"state": ("fault",)},
        for_s=10,
    ),
    AlertCondition(
        *("VlaLateTicks", _WARNING, "vla_control_late_ticks_total"),
        "More than 1 % of control's ticks come late.",
        "vla-deploy doctor says what keeps control from its priority",
        of="vla_control_ticks_total",
        per_s=60,
        above=0.01,
        for_s=60,
    ),
    AlertCondition(
        *("VlaProcessGivenUp", _CRITICAL, "vla_process_state"),
        *("A process has failed too often and is given up.", "vla-deploy logs, vla-deploy crashes"),
        where={"state": ("given up",)},
    ),
    AlertCondition(
        *("VlaProcessRestarts", _WARNING, "vla_process_restarts_total"),
        *("A process is started again and again.", "vla-deploy crashes"),
        per_s=600,
        above=0.003,
    ),
    AlertCondition(
        *("VlaTopicsLate", _WARNING, "vla_process_alarms"),
        *("A process' topics are too old, too slow or not valid.", "vla-deploy status"),
        for_s=10,
    ),
    AlertCondition(
        *("VlaCommandsRefused", _CRITICAL, "vla_commands_taken"),
        *("The robot takes no commands.", "vla-deploy status says why"),
        above=None,
        below=1.0,
        for_s=5,
    ),
    AlertCondition(
        *("VlaBudgetBroken", _WARNING, "vla_budget_over"),
        *("A budget is broken.", "vla-deploy budget shows the line and what is done about it"),
        for_s=30,
    ),
    AlertCondition(
        *("VlaBudgetStop", _CRITICAL, "vla_budget_stop"),
        *("A budget has stopped the robot.", "vla-deploy budget says which"),
    ),
    AlertCondition(
        *("VlaBusDegraded", _WARNING, "vla_bus_state"),
        *("A servo bus loses answers.", "Look at cable, connectors and supply"),
        where={"state": ("degraded",)},
        for_s=30,
    ),
    AlertCondition(
        *("VlaBusLost", _CRITICAL, "vla_bus_state"),
        *("A servo bus has used up its error budget.", "Look at cable, connectors and supply"),
        where={"state": ("lost",)},
    ),
    AlertCondition(
        *("VlaBusFaults", _WARNING, "vla_bus_faults_total"),
        "Something goes wrong on a bus more than once a second.",
        "vla-deploy status --json has the counters; look at the wiring",
        per_s=60,
        above=1.0,
        for_s=60,
    ),
    AlertCondition(
        *("VlaJointWarm", _WARNING, "vla_joint_temperature_celsius"),
        *("A joint's servo is warm.", "Let it rest, or give it less to hold"),
        above=65.0,
        for_s=60,
    ),
    AlertCondition(
        *("VlaJointError", _CRITICAL, "vla_joint_hardware_error"),
        *("A joint's servo reports a hardware error.", "vla-deploy servo monitor; then reset"),
    ),
    AlertCondition(
        *("VlaComputerHot", _WARNING, "vla_temperature_celsius"),
        *("The computer is hot.", "Look at fan and airflow; vla-deploy budget"),
        above=85.0,
        for_s=60,
    ),
    AlertCondition(
        *("VlaPowerFault", _CRITICAL, "vla_throttle_events_total"),
        "The supply of the computer fails: under-voltage or average over-current.",
        "Look at battery, cable and power mode",
        where={"kind": ("oc1", "oc2")},
        per_s=60,
    ),
    AlertCondition(
        *("VlaBatteryLow", _WARNING, "vla_battery_low"),
        *("The battery is low.", "Let it charge: vla-deploy say go and charge"),
    ),
    AlertCondition(
        *("VlaBatteryCritical", _CRITICAL, "vla_battery_critical"),
        *("The battery is nearly empty.", "Let it charge: vla-deploy say go and charge"),
    ),
    AlertCondition(
        *("VlaDiskNearlyFull", _WARNING, "vla_disk_free_ratio"),
        "A disk that the robot writes to is nearly full.",
        "Make room; the robot's own logs and recordings are bounded",
        above=None,
        below=0.05,
        for_s=60,
    ),
    AlertCondition(
        *("VlaPlaceLost", _WARNING, "vla_place_state"),
        *("The robot does not know where it is.", "vla-deploy status says why"),
        where={"state": ("lost",)},
        for_s=10,
    ),
    AlertCondition(
        *("VlaSensorAway", _WARNING, "vla_perception_sensors_away"),
        *("A sensor gives nothing.", "vla-deploy doctor"),
        for_s=10,
    ),
    AlertCondition(
        *("VlaSightByForm", _WARNING, "vla_perception_sight"),
        *("The robot names things without its network.", "vla-deploy status says why"),
        where={"mode": ("form",)},
        for_s=60,
    ),
)
