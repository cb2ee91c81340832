"""Turn what is told into values where it is no plain number."""

from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from math import inf
from typing import Any

from vla_deploy.telemetry.metrics.kinds import Histogram


def count_of(told: Any) -> float | None:
    """Return how many there are: of a list, an object, or told as a number."""
    if isinstance(told, Mapping | Sequence) and not isinstance(told, str):
        return float(len(told))
    return float(told) if isinstance(told, int | float) else None


def is_empty(told: Any) -> float | None:
    """Return 1 for an empty text, 0 for one that says something."""
    return float(told == "") if isinstance(told, str) else None


def is_any(told: Any) -> float | None:
    """Return 1 where any bit is set."""
    return float(bool(told)) if isinstance(told, int) else None


def column(name: str) -> Callable[[Any], float | None]:
    """Return what takes one number out of a row."""

    def take(row: Any) -> float | None:
        told = row.get(name)
        return float(told) if isinstance(told, bool | int | float) else None

    return take


def share_of_limit(row: Any) -> float | None:
    """Return how much of a budget's line is used; of a lower limit, how much of the rest."""
    measured, limit = row["measured"], row["limit"]
    if measured is None or min(measured, limit) <= 0.0:
        return 0.0 if measured == 0.0 and not row["at_least"] else None
    return float(limit / measured if row["at_least"] else measured / limit)


def counts_between(told: Any) -> Histogram | None:
    """Return a histogram told by the counts between its bounds, the last beyond all."""
    if not isinstance(told, Mapping) or "le" not in told:
        return None
    return Histogram(
        bounds=(*told["le"], inf),
        totals=tuple(float(count) for count in accumulate(told["counts"])),
        sum=float(told["sum"]),
    )


def counts_below(told: Any) -> Histogram | None:
    """Return a histogram told by the counts below its bounds, and the count of all."""
    if not isinstance(told, Mapping) or "le_s" not in told:
        return None
    return Histogram(
        bounds=(*told["le_s"], inf),
        totals=(*(float(count) for count in told["counts"]), float(told["count"])),
        sum=float(told["sum_s"]),
    )
