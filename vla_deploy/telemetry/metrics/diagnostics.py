"""Map readings to diagnostic_msgs/DiagnosticArray, as plain data: no ROS is needed for it."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.metrics.conditions import CONDITIONS
from vla_deploy.telemetry.metrics.metric import PREFIX, Metric, MetricKind, MissingReason, Point
from vla_deploy.telemetry.metrics.reading import Readings
from vla_deploy.telemetry.metrics.table import METRICS, METRICS_BY_NAME

SUBJECTS: Final = {"process": "Processes", "bus": "Buses", "joint": "Joints", "topic": "Topics"}
"""Labels whose values are parts of their own, and the group of these parts."""

_GROUPS: Final[tuple[tuple[tuple[str, ...], str], ...]] = (
    (("vla_safety_", "vla_estop_"), "Safety"),
    (("vla_control_",), "Control"),
    (("vla_base_",), "Base"),
    (("vla_planner_", "vla_executor_", "vla_commands_"), "Planning"),
    (("vla_speech_",), "Hearing"),
    (("vla_perception_",), "Seeing"),
    (("vla_place_",), "Place"),
    (("vla_flight_recorder_",), "Flight recorder"),
    (("vla_twin_",), "Twin"),
    (("vla_battery_",), "Battery"),
    (("vla_budget_", "vla_ladder_", "vla_memory_peak"), "Budgets"),
    (("vla_dashboard_", "vla_metrics_", "vla_build_", "vla_robot_"), "Dashboard"),
)
_LONGEST_TEXT: Final = 500


class DiagnosticLevel(IntEnum):
    """Number the levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(slots=True)
class _Part:
    """Collect the status of one part of the robot."""

    level: DiagnosticLevel = DiagnosticLevel.OK
    words: list[str] = field(default_factory=list)
    values: list[tuple[str, str]] = field(default_factory=list)
    silent: str = ""


def diagnostics(readings: Readings, wall_ns: int) -> dict[str, Any]:
    """Return the array: a status for every part, with its worst condition as its level.

    A part without any value because its topics are silent is STALE.
    """
    parts: dict[str, _Part] = defaultdict(_Part)
    for metric in METRICS:
        for point in readings.points.get(metric.name, ()):
            _note(parts, metric, point)
    for missing in readings.missing:
        part = parts[group_of(METRICS_BY_NAME[missing.metric])]
        if missing.why is MissingReason.SILENT:
            part.silent = part.silent or missing.text
        else:
            part.values.append((missing.metric.removeprefix(PREFIX), f"missing: {missing.text}"))
    robot = _robot_of(readings)
    seconds, nanoseconds = divmod(wall_ns, NS_PER_S)
    return {
        "header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": ""},
        "status": [_status(robot, name, part) for name, part in sorted(parts.items())],
    }


def _note(parts: dict[str, _Part], metric: Metric, point: Point) -> None:
    labels = dict(zip(metric.labels, point.labels, strict=True))
    part = parts[part_of(metric, labels)]
    part.values.extend(_values(metric, labels, point))
    for condition in CONDITIONS:
        if condition.metric == metric.name and condition.holds(point):
            part.level = max(part.level, DiagnosticLevel(condition.severity))
            part.words.append(condition.summary)


def _values(metric: Metric, labels: dict[str, str], point: Point) -> Iterator[tuple[str, str]]:
    """Yield key and text of a value: of states, the name of the one in force."""
    if not isinstance(point.value, float):
        return
    if metric.kind is MetricKind.STATES:
        if point.value:
            yield metric.name.removeprefix(PREFIX), labels[metric.state_label]
        return
    others = [value for label, value in labels.items() if label not in SUBJECTS]
    key = " ".join((metric.name.removeprefix(PREFIX), *others))
    yield key, f"{point.value:.9g}"


def _status(robot: str, name: str, part: _Part) -> dict[str, Any]:
    if not part.values and part.silent:
        level, message = DiagnosticLevel.STALE, part.silent
    else:
        level, message = part.level, " ".join(dict.fromkeys(part.words)) or "OK"
    _, _, subject = name.partition("/")
    return {
        "level": int(level),
        "name": f"/{robot}/{name}",
        "message": message[:_LONGEST_TEXT],
        "hardware_id": f"{robot}/{subject}" if subject else robot,
        "values": [{"key": key, "value": value[:_LONGEST_TEXT]} for key, value in part.values],
    }


def _robot_of(readings: Readings) -> str:
    points = readings.points.get("vla_robot_info", ())
    return points[0].labels[0] if points else "robot"


def part_of(metric: Metric, labels: dict[str, str]) -> str:
    """Return the part of the robot that a value belongs to, as a path with slashes."""
    for label, group in SUBJECTS.items():
        if label in labels:
            return f"{group}/{labels[label]}"
    return group_of(metric)


def group_of(metric: Metric) -> str:
    """Return the group of a metric's parts."""
    subject = next((SUBJECTS[label] for label in metric.labels if label in SUBJECTS), None)
    if subject is not None:
        return subject
    return next(
        (group for prefixes, group in _GROUPS if metric.name.startswith(prefixes)), "Computer"
    )
