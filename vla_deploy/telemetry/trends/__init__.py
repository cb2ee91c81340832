"""The history of the metrics: bounded, in four levels, kept over restarts."""

from vla_deploy.telemetry.trends.series import KEPT, SeriesMaker, unit_of
from vla_deploy.telemetry.trends.store import LEVELS, Trend, Trends, TrendStore, level_for

__all__ = [
    "KEPT",
    "LEVELS",
    "SeriesMaker",
    "Trend",
    "TrendStore",
    "Trends",
    "level_for",
    "unit_of",
]
