"""What is measured of the robot: one table, and how it is read out of the topics."""

from vla_deploy.telemetry.metrics.exposition import expose
from vla_deploy.telemetry.metrics.kinds import (
    MOST_SERIES,
    PREFIX,
    Histogram,
    Kind,
    Metric,
    Missing,
    Point,
    Why,
)
from vla_deploy.telemetry.metrics.look import Look, Looker, Told
from vla_deploy.telemetry.metrics.reading import Readings, read
from vla_deploy.telemetry.metrics.table import METRICS, METRICS_BY_NAME, READ_TOPICS

__all__ = [
    "METRICS",
    "METRICS_BY_NAME",
    "MOST_SERIES",
    "PREFIX",
    "READ_TOPICS",
    "Histogram",
    "Kind",
    "Look",
    "Looker",
    "Metric",
    "Missing",
    "Point",
    "Readings",
    "Told",
    "Why",
    "expose",
    "read",
]
