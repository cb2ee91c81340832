"""Write readings for Prometheus: its text format, or OpenMetrics where a scraper asks for it."""

from collections.abc import Iterator
from math import isinf
from typing import Final

from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
)
from prometheus_client.metrics_core import (
    Metric as Family,
)
from prometheus_client.registry import Collector, CollectorRegistry

from vla_deploy.telemetry.metrics.kinds import Histogram, Kind, Metric, Point
from vla_deploy.telemetry.metrics.reading import Readings
from vla_deploy.telemetry.metrics.table import METRICS_BY_NAME

MISSING: Final = "vla_metric_missing"
_MISSING_HELP: Final = (
    "1 for each metric that has no value now, by why: its topic is silent, does not tell it, or "
    "the computer cannot be asked. GET /api/v1/metrics says it in words."
)


def expose(readings: Readings, accept: str = "") -> tuple[bytes, str]:
    """Return the text for a scraper, and its content type; `accept` is what it asked for."""
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Once(readings))
    encode, content_type = choose_encoder(accept)
    return encode(registry), content_type


class _Once(Collector):
    """Hand out one reading of all metrics."""

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
    unit = metric.unit
    match metric.kind:
        case Kind.COUNTER:
            counter = CounterMetricFamily(metric.name, metric.help, labels=metric.labels, unit=unit)
            for point in points:
                counter.add_metric(point.labels, _plain(point))
            return counter
        case Kind.HISTOGRAM:
            histogram = HistogramMetricFamily(
                metric.name, metric.help, labels=metric.labels, unit=unit
            )
            for point in points:
                if isinstance(point.value, Histogram):
                    histogram.add_metric(
                        point.labels, _buckets(point.value), sum_value=point.value.sum
                    )
            return histogram
        case Kind.INFO:
            info = InfoMetricFamily(metric.name.removesuffix("_info"), metric.help, labels=())
            for point in points:
                info.add_metric((), dict(zip(metric.labels, point.labels, strict=True)))
            return info
        case Kind.GAUGE | Kind.STATES:
            gauge = GaugeMetricFamily(metric.name, metric.help, labels=metric.labels, unit=unit)
            for point in points:
                gauge.add_metric(point.labels, _plain(point))
            return gauge


def _plain(point: Point) -> float:
    if isinstance(point.value, Histogram):
        raise TypeError("a histogram is no plain number")
    return point.value


def _buckets(histogram: Histogram) -> list[tuple[str, float]]:
    return [
        ("+Inf" if isinf(bound) else f"{bound:g}", total)
        for bound, total in zip(histogram.bounds, histogram.totals, strict=True)
    ]
