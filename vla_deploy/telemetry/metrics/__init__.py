"""What is measured of the robot: one table, and how it is read out of the topics."""

from vla_deploy.telemetry.metrics.metric import (
    MAX_SERIES,
    PREFIX,
    Histogram,
    Metric,
    MetricKind,
    MissingMetric,
    MissingReason,
    Point,
)
from vla_deploy.telemetry.metrics.prometheus import expose
from vla_deploy.telemetry.metrics.reading import Readings, TopicSampler, TopicSnapshot, read
from vla_deploy.telemetry.metrics.table import METRICS, METRICS_BY_NAME, READ_TOPICS

__all__ = [
    "MAX_SERIES",
    "METRICS",
    "METRICS_BY_NAME",
    "PREFIX",
    "READ_TOPICS",
    "Histogram",
    "Metric",
    "MetricKind",
    "MissingMetric",
    "MissingReason",
    "Point",
    "Readings",
    "TopicSampler",
    "TopicSnapshot",
    "expose",
    "read",
]
