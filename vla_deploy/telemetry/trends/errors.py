"""Group the errors of the history.

TrendError
├── TrendsUnavailable   its files cannot be made or opened: make room, or mend the folder
└── SeriesUnknown       nothing of that name is kept: list what is
"""


class TrendError(Exception):
    """Base of everything that the history raises."""


class TrendsUnavailable(TrendError):
    """Say that the history's files cannot be had."""


class SeriesUnknown(TrendError):
    """Say that no such series is kept."""
