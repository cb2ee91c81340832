"""Write a Grafana dashboard from the table of metrics."""

from collections.abc import Iterator
from itertools import count
from typing import Any, Final

from vla_deploy.telemetry.metrics import computer, control, model_metrics, processes
from vla_deploy.telemetry.metrics.metric import Metric, MetricKind
from vla_deploy.telemetry.metrics.table import FLOW

_WIDTH: Final = 24
_COLUMNS: Final = 3
_HEIGHT: Final = 7
_SOURCE: Final = {"type": "prometheus", "uid": "${source}"}
# What Grafana calls our units.
_UNITS: Final = {
    "seconds": "s",
    "bytes": "bytes",
    "celsius": "celsius",
    "watts": "watt",
    "volts": "volt",
    "hertz": "hertz",
    "ratio": "percentunit",
    "meters_per_second": "velocityms",
    "rpm": "rotrpm",
}
_ROWS: Final[tuple[tuple[str, tuple[Metric, ...]], ...]] = (
    ("Safety", control.SAFETY),
    ("Control", control.TICKS),
    ("Processes and budgets", processes.METRICS),
    ("Computer", computer.METRICS),
    ("Battery", computer.BATTERY),
    ("Buses", control.BUSES),
    ("Joints and base", control.JOINTS),
    ("Planning", model_metrics.PLANNING),
    ("Hearing", model_metrics.HEARING),
    ("Seeing", model_metrics.SEEING),
    ("Recorder and twin", model_metrics.KEEPING),
    ("Topics", FLOW),
)


def grafana_dashboard() -> dict[str, Any]:
    """Return the dashboard in the form that Grafana imports."""
    return {
        "title": "vla_deploy robot",
        "uid": "vla-deploy",
        "tags": ["robot"],
        "schemaVersion": 39,
        "timezone": "browser",
        "refresh": "10s",
        "time": {"from": "now-1h", "to": "now"},
        "templating": {"list": [_SOURCE_CHOICE, _ROBOT_CHOICE]},
        "panels": list(_panels()),
    }


def _panels() -> Iterator[dict[str, Any]]:
    numbers, y = count(1), 0
    for title, metrics in _ROWS:
        place = {"h": 1, "w": _WIDTH, "x": 0, "y": y}
        yield {"id": next(numbers), "type": "row", "title": title, "gridPos": place, "panels": []}
        y += 1
        shown = [metric for metric in metrics if metric.kind is not MetricKind.INFO]
        for place_number, metric in enumerate(shown):
            line, column = divmod(place_number, _COLUMNS)
            width = _WIDTH // _COLUMNS
            at = {"h": _HEIGHT, "w": width, "x": column * width, "y": y + line * _HEIGHT}
            yield _panel(next(numbers), metric, at)
        y += _HEIGHT * -(-len(shown) // _COLUMNS)


def _panel(number: int, metric: Metric, place: dict[str, int]) -> dict[str, Any]:
    kind = "state-timeline" if metric.kind is MetricKind.STATES else "timeseries"
    return {
        "id": number,
        "type": kind,
        "title": metric.help.partition(":")[0].removesuffix("."),
        "description": f"{metric.name}: {metric.help}",
        "datasource": _SOURCE,
        "gridPos": place,
        "fieldConfig": {"defaults": {"unit": _unit(metric)}, "overrides": []},
        "targets": [
            {
                "refId": "A",
                "datasource": _SOURCE,
                "expr": query(metric),
                "legendFormat": _legend(metric),
            }
        ],
    }


def query(metric: Metric) -> str:
    """Return what a panel asks for: counters by the second, histograms by their 99 %."""
    chosen = f'{metric.name}{{instance=~"$robot"}}'
    match metric.kind:
        case MetricKind.COUNTER:
            return f"rate({chosen}[$__rate_interval])"
        case MetricKind.HISTOGRAM:
            by = ", ".join(("le", *metric.labels))
            buckets = f'{metric.name}_bucket{{instance=~"$robot"}}'
            return f"histogram_quantile(0.99, sum by ({by}) (rate({buckets}[$__rate_interval])))"
        case MetricKind.STATES:
            return f"{chosen} == 1"
        case _:
            return chosen


def _legend(metric: Metric) -> str:
    return " ".join(f"{{{{{label}}}}}" for label in metric.labels) or "{{instance}}"


def _unit(metric: Metric) -> str:
    if metric.kind is MetricKind.COUNTER:
        return "percentunit" if metric.unit == "seconds" else "cps"
    return _UNITS.get(metric.unit, "short")


_SOURCE_CHOICE: Final = {"name": "source", "type": "datasource", "query": "prometheus"}
_ROBOT_CHOICE: Final = {
    "name": "robot",
    "type": "query",
    "label": "Robot",
    "datasource": _SOURCE,
    "query": "label_values(vla_robot_info, instance)",
    "refresh": 2,
    "includeAll": True,
    "multi": True,
    "current": {"text": "All", "value": "$__all"},
}
