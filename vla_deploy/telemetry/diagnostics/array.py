"""Map readings to diagnostic_msgs/DiagnosticArray, as plain data: no ROS is needed for it."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.diagnostics.groups import SUBJECTS, group_of, part_of
from vla_deploy.telemetry.metrics import (
    METRICS,
    METRICS_BY_NAME,
    PREFIX,
    Kind,
    Metric,
    Point,
    Readings,
    Why,
)
from vla_deploy.telemetry.metrics.conditions import CONDITIONS

_LONGEST: Final = 500


class Level(IntEnum):
    """Number the levels as DiagnosticStatus does."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(slots=True)
class _Part:
    """Collect what there is to say of one part of the robot."""

    level: Level = Level.OK
    words: list[str] = field(default_factory=list)
    values: list[tuple[str, str]] = field(default_factory=list)
    silent: str = ""


def diagnostics(readings: Readings, wall_ns: int) -> dict[str, Any]:
    """Return the array: a status for every part, the worst condition of it as its level.

    A part of which nothing is known because its process is silent is STALE.
    """
    parts: dict[str, _Part] = defaultdict(_Part)
    for metric in METRICS:
        for point in readings.points.get(metric.name, ()):
            _note(parts, metric, point)
    for missing in readings.missing:
        part = parts[group_of(METRICS_BY_NAME[missing.metric])]
        if missing.why is Why.SILENT:
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
            part.level = max(part.level, Level(condition.severity))
            part.words.append(condition.summary)


def _values(metric: Metric, labels: dict[str, str], point: Point) -> Iterator[tuple[str, str]]:
    """Yield what is shown of a value: a state by its name, and only the one in force."""
    if not isinstance(point.value, float):
        return
    if metric.kind is Kind.STATES:
        if point.value:
            yield metric.name.removeprefix(PREFIX), labels[metric.state_label]
        return
    others = [value for label, value in labels.items() if label not in SUBJECTS]
    key = " ".join((metric.name.removeprefix(PREFIX), *others))
    yield key, f"{point.value:.9g}"


def _status(robot: str, name: str, part: _Part) -> dict[str, Any]:
    if not part.values and part.silent:
        level, message = Level.STALE, part.silent
    else:
        level, message = part.level, " ".join(dict.fromkeys(part.words)) or "OK"
    _, _, subject = name.partition("/")
    return {
        "level": int(level),
        "name": f"/{robot}/{name}",
        "message": message[:_LONGEST],
        "hardware_id": f"{robot}/{subject}" if subject else robot,
        "values": [{"key": key, "value": value[:_LONGEST]} for key, value in part.values],
    }


def _robot_of(readings: Readings) -> str:
    points = readings.points.get("vla_robot_info", ())
    return points[0].labels[0] if points else "robot"
