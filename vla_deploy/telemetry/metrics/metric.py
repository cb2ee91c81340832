"""Declare what a metric is, the values read for it, and how a document's value becomes one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from enum import Enum
from itertools import accumulate
from math import inf
from typing import Any, Final

from vla_deploy.telemetry.metrics.paths import Path, labels_of

PREFIX: Final = "vla_"
MAX_SERIES: Final = 64
"""Series per metric; those beyond are left out and counted."""
_UNITS: Final = (
    *("meters_per_second", "radians_per_second", "seconds", "bytes", "ratio", "celsius"),
    *("watts", "volts", "hertz", "cores", "rpm"),
)


class MetricKind(Enum):
    """Name the kinds of Prometheus, and STATES: a gauge per state, 1 for the one in force."""

    GAUGE = "gauge"
    COUNTER = "counter"
    HISTOGRAM = "histogram"
    INFO = "info"
    STATES = "states"


class MissingReason(Enum):
    """Name why a metric has no value."""

    SILENT = "silent"  # its topic was never written, or not recently
    NOT_REPORTED = "untold"  # its topic is fresh and does not contain it
    UNREADABLE = "unreadable"  # it cannot be read on this computer; the document says why


# By the last word of a name.
_KINDS: Final = {"total": MetricKind.COUNTER, "info": MetricKind.INFO}


@dataclass(frozen=True, slots=True, kw_only=True)
class Histogram:
    """Carry counts up to each upper bound, the last one infinite, and the sum of all values."""

    bounds: tuple[float, ...]
    totals: tuple[float, ...]
    sum: float


Value = float | Histogram


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """Carry one value of a metric; `labels` are the values of its labels, in their order."""

    labels: tuple[str, ...]
    value: Value


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingMetric:
    """Carry why a metric has no value; `text` is for people and may be long."""

    metric: str
    why: MissingReason
    text: str


def number(value: Any) -> float | None:
    """Return a number, a bool as 0 or 1, or None for anything else."""
    return float(value) if isinstance(value, bool | int | float) else None


@dataclass(frozen=True, slots=True)
class Metric:
    """Declare one metric: its name by the conventions of Prometheus, and where it is read from.

    Each of `paths` leads through the document of `topic`; the values found are converted by `take`
    and multiplied by `scale`. Metrics that are `kept` go to the history: gauges as they are,
    counters as their rate per second.
    """

    name: str
    help: str
    paths: tuple[Path, ...]
    _: KW_ONLY
    topic: str
    scale: float = 1.0
    take: Callable[[Any], Value | None] = number
    states: tuple[str, ...] = ()
    state_label: str = "state"
    kept: bool = False

    @property
    def kind(self) -> MetricKind:
        """Return the kind; counters and infos are known by their names."""
        if self.states:
            return MetricKind.STATES
        if self.take in (counts_between, counts_below):
            return MetricKind.HISTOGRAM
        return _KINDS.get(self.name.rpartition("_")[2], MetricKind.GAUGE)

    @property
    def unit(self) -> str:
        """Return the unit that the name ends with, before a counter's `_total`; "" for none."""
        name = self.name.removesuffix("_total")
        return next((unit for unit in _UNITS if name.endswith(f"_{unit}")), "")

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the names of its labels."""
        own = (self.state_label,) if self.kind is MetricKind.STATES else ()
        return (*labels_of(self.paths[0]), *own)


def count_of(value: Any) -> float | None:
    """Return the number of items of a list or an object, or a number as it is."""
    if isinstance(value, Mapping | Sequence) and not isinstance(value, str):
        return float(len(value))
    return float(value) if isinstance(value, int | float) else None


def is_empty(value: Any) -> float | None:
    """Return 1 for an empty text, 0 for any other text."""
    return float(value == "") if isinstance(value, str) else None


def is_any(value: Any) -> float | None:
    """Return 1 where any bit is set."""
    return float(bool(value)) if isinstance(value, int) else None


def column(name: str) -> Callable[[Any], float | None]:
    """Return a function that takes one number out of a row."""
    return lambda row: number(row.get(name))


def share_of_limit(row: Any) -> float | None:
    """Return the used share of a budget's limit; of a lower limit, the share of the rest."""
    measured, limit = row["measured"], row["limit"]
    if measured is None or min(measured, limit) <= 0.0:
        return 0.0 if measured == 0.0 and not row["at_least"] else None
    return float(limit / measured if row["at_least"] else measured / limit)


def counts_between(value: Any) -> Histogram | None:
    """Return a histogram given as counts between bounds, the last count beyond all of them."""
    if not isinstance(value, Mapping) or "le" not in value:
        return None
    return Histogram(
        bounds=(*value["le"], inf),
        totals=tuple(float(count) for count in accumulate(value["counts"])),
        sum=float(value["sum"]),
    )


def counts_below(value: Any) -> Histogram | None:
    """Return a histogram given as counts below bounds, and the count of all values."""
    if not isinstance(value, Mapping) or "le_s" not in value:
        return None
    return Histogram(
        bounds=(*value["le_s"], inf),
        totals=(*(float(count) for count in value["counts"]), float(value["count"])),
        sum=float(value["sum_s"]),
    )
