"""Read every metric of the table out of one look at the topics."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from vla_deploy.telemetry.metrics.kinds import (
    MOST_SERIES,
    Histogram,
    Kind,
    Metric,
    Missing,
    Point,
    Why,
)
from vla_deploy.telemetry.metrics.look import Look, Told
from vla_deploy.telemetry.metrics.paths import At, Path, Place, walk
from vla_deploy.telemetry.metrics.table import METRICS

ReadPoints = Mapping[str, tuple[Point, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Readings:
    """Carry the points of each metric that has some, and why the others have none."""

    now_ns: int
    points: ReadPoints
    missing: tuple[Missing, ...]
    left_out: int


def read(look: Look, metrics: Iterable[Metric] = METRICS) -> Readings:
    """Return every metric's points; a metric beyond `MOST_SERIES` loses its last ones."""
    points: dict[str, tuple[Point, ...]] = {}
    missing: list[Missing] = []
    left_out = 0
    for metric in metrics:
        told = look.told[metric.topic]
        found = [] if told.document is None else _points(metric, told.document)
        left_out += max(len(found) - MOST_SERIES, 0)
        if found:
            points[metric.name] = tuple(found[:MOST_SERIES])
        else:
            missing.append(_missing(metric, told))
    return Readings(now_ns=look.now_ns, points=points, missing=tuple(missing), left_out=left_out)


def _points(metric: Metric, document: Any) -> list[Point]:
    places = [place for path in metric.paths for place in walk(path, document)]
    if metric.kind is Kind.STATES:
        return [point for place in places for point in _of_states(metric, place)]
    return [point for place in places if (point := _of_value(metric, place)) is not None]


def _of_value(metric: Metric, place: Place) -> Point | None:
    value = None if place.told is None else metric.take(place.told)
    if value is None:
        return None
    scaled = value if isinstance(value, Histogram) else value * metric.scale
    return Point(labels=place.labels, value=scaled)


def _of_states(metric: Metric, place: Place) -> list[Point]:
    return [
        Point(labels=(*place.labels, state), value=float(place.told == state))
        for state in metric.states
    ]


def _missing(metric: Metric, told: Told) -> Missing:
    if told.document is None:
        return Missing(metric=metric.name, why=Why.SILENT, text=told.reason)
    known = _told_why(metric, told.document)
    if known:
        return Missing(metric=metric.name, why=Why.UNREADABLE, text=known)
    text = f"{metric.topic} does not tell it at present"
    return Missing(metric=metric.name, why=Why.UNTOLD, text=text)


def _told_why(metric: Metric, document: Any) -> str:
    """Return the reason that goes with a reading of the computer."""
    reasons: Mapping[str, str] = document.get("missing") or {}
    wanted = [key for path in metric.paths for key in _last_keys(path)]
    return next((reasons[key] for key in wanted if key in reasons), "")


def _last_keys(path: Path) -> tuple[str, ...]:
    step = path[-1]
    return step.keys[-1:] if isinstance(step, At) else ()
