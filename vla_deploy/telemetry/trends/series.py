"""Turn readings into the series of the history: gauges as they are, counters as rates."""

from collections.abc import Iterator, Mapping
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.metrics import (
    METRICS,
    METRICS_BY_NAME,
    Metric,
    MetricKind,
    Point,
    Readings,
)

KEPT: Final[Mapping[str, Metric]] = {metric.name: metric for metric in METRICS if metric.kept}


class SeriesMaker:
    """Compute rates from the counters of the last readings."""

    def __init__(self) -> None:
        self._before: dict[str, float] = {}
        self._before_ns = 0

    def values(self, readings: Readings) -> dict[str, float]:
        """Return the value of each series; a counter begins with its second reading."""
        gauges = dict(_of_kind(readings, MetricKind.GAUGE))
        counters = dict(_of_kind(readings, MetricKind.COUNTER))
        elapsed_s = (readings.now_ns - self._before_ns) / NS_PER_S
        before, self._before, self._before_ns = self._before, counters, readings.now_ns
        if elapsed_s <= 0.0:
            return gauges
        # A counter lower than before was reset: its value is its gain since.
        rates = {
            series: (count - before[series] if count >= before[series] else count) / elapsed_s
            for series, count in counters.items()
            if series in before
        }
        return {**gauges, **rates}


def _of_kind(readings: Readings, kind: MetricKind) -> Iterator[tuple[str, float]]:
    for name, metric in KEPT.items():
        if metric.kind is kind:
            for point in readings.points.get(name, ()):
                if isinstance(point.value, float):
                    yield series_of(name, point), point.value


def series_of(name: str, point: Point) -> str:
    """Return the name of a series: its metric and the values of its labels, by slashes."""
    return "/".join((name, *(value.replace("/", "_").replace(",", "_") for value in point.labels)))


def unit_of(series: str) -> str:
    """Return the unit of a series; a counter's is per second."""
    metric = METRICS_BY_NAME[series.partition("/")[0]]
    if metric.kind is MetricKind.COUNTER:
        return f"{metric.unit or '1'}/s"
    return metric.unit
