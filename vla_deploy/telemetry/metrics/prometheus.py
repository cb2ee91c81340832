"""Write the metrics for Prometheus: the text that it scrapes, and its file of alert rules."""

from collections.abc import Iterator
from math import isinf
from typing import Any, Final

from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import GaugeMetricFamily
from prometheus_client.metrics_core import (
    Metric as Family,
)
from prometheus_client.registry import Collector, CollectorRegistry

from vla_deploy.telemetry.metrics.conditions import CONDITIONS, AlertCondition
from vla_deploy.telemetry.metrics.metric import (
    Histogram,
    Metric,
    MetricKind,
    MissingReason,
    Point,
)
from vla_deploy.telemetry.metrics.reading import Readings
from vla_deploy.telemetry.metrics.table import METRICS_BY_NAME

# Types of Prometheus where they differ from our kinds.
_TYPES: Final = {MetricKind.STATES: "gauge"}
MISSING: Final = "vla_metric_missing"
_MISSING_HELP: Final = (
    "1 for each metric that has no value now, by why: its topic is silent, does not tell it, or "
    "the computer cannot be asked. GET /api/v1/metrics says it in words."
)


def expose(readings: Readings, accept: str = "") -> tuple[bytes, str]:
    """Return the text for a scraper and its content type; `accept` is the request's header."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Once(readings))
    encode, content_type = choose_encoder(accept)
    return encode(registry), content_type


class _Once(Collector):
    """Collect one reading of all metrics."""

    def __init__(self, readings: Readings) -> None:
        self._readings = readings

    def collect(self) -> Iterator[Family]:
        for name, points in self._readings.points.items():
            yield _family(METRICS_BY_NAME[name], points)
        missing = GaugeMetricFamily(MISSING, _MISSING_HELP, labels=("metric", "why"))
        for one in self._readings.missing:
            missing.add_metric((one.metric, one.why.value), 1.0)
        yield missing


def _family(metric: Metric, points: tuple[Point, ...]) -> Family:
    name = metric.name.removesuffix("_total").removesuffix("_info")
    family = Family(name, metric.help, _TYPES.get(metric.kind, metric.kind.value), metric.unit)
    for point in points:
        labels = dict(zip(metric.labels, point.labels, strict=True))
        value = point.value
        if isinstance(value, Histogram):
            for bound, total in zip(value.bounds, value.totals, strict=True):
                le = "+Inf" if isinf(bound) else f"{bound:g}"
                family.add_sample(f"{name}_bucket", {**labels, "le": le}, total)
            family.add_sample(f"{name}_count", labels, value.totals[-1])
            family.add_sample(f"{name}_sum", labels, value.sum)
        else:
            family.add_sample(metric.name, labels, value)
    return family


JOB: Final = "vla_deploy"
_GROUP: Final = "vla_deploy"
_VITAL: Final = "vla_control_state|vla_process_state"


def alert_rules() -> dict[str, Any]:
    """Return the rule file as plain data."""
    rules = [_DOWN, _SILENT, *(_rule(condition) for condition in CONDITIONS)]
    return {"groups": [{"name": _GROUP, "rules": rules}]}


def expression(condition: AlertCondition) -> str:
    """Return the condition in PromQL."""
    chosen = condition.metric + _selector(condition)
    if condition.per_s:
        chosen = f"rate({chosen}[{condition.per_s}s])"
    if condition.of:
        chosen += f" / rate({condition.of}[{condition.per_s}s])"
    if condition.above is not None:
        return f"{chosen} > {condition.above:g}"
    return f"{chosen} < {condition.below:g}"


def _selector(condition: AlertCondition) -> str:
    inside = ",".join(f'{label}=~"{"|".join(of)}"' for label, of in condition.where.items())
    return f"{{{inside}}}" if inside else ""


def _rule(condition: AlertCondition) -> dict[str, Any]:
    return {
        "alert": condition.name,
        "expr": expression(condition),
        "for": f"{condition.for_s}s",
        "labels": {"severity": condition.severity.name.lower()},
        "annotations": {"summary": condition.summary, "description": condition.remedy},
    }


_DOWN: Final = {
    "alert": "VlaRobotUnreachable",
    "expr": f'up{{job="{JOB}"}} == 0',
    "for": "30s",
    "labels": {"severity": "critical"},
    "annotations": {
        "summary": "The robot's dashboard cannot be scraped.",
        "description": "Is the robot switched on, and the token valid? vla-deploy status",
    },
}
_SILENT: Final = {
    "alert": "VlaProcessSilent",
    "expr": f'{MISSING}{{metric=~"{_VITAL}",why="{MissingReason.SILENT.value}"}} == 1',
    "for": "10s",
    "labels": {"severity": "critical"},
    "annotations": {
        "summary": "Control or the supervisor tells nothing.",
        "description": "vla-deploy status; vla-deploy logs",
    },
}
