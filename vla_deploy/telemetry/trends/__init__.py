"""The history of what is measured: bounded, in four levels, over restarts."""

from vla_deploy.telemetry.trends.errors import SeriesUnknown, TrendError, TrendsUnavailable
from vla_deploy.telemetry.trends.levels import LEVELS, Level, level_for
from vla_deploy.telemetry.trends.series import KEPT, SeriesMaker, series_of, unit_of
from vla_deploy.telemetry.trends.store import Trend, Trends, TrendStore

__all__ = [
    "KEPT",
    "LEVELS",
    "Level",
    "SeriesMaker",
    "SeriesUnknown",
    "Trend",
    "TrendError",
    "TrendStore",
    "Trends",
    "TrendsUnavailable",
    "level_for",
    "series_of",
    "unit_of",
]
