"""Declare what a metric is, and what is read for it: points, or the reason why there is none."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from vla_deploy.telemetry.metrics.paths import Path, labels_of

PREFIX: Final = "vla_"
MOST_SERIES: Final = 64
"""How many series a metric may have; what is beyond is left out and counted."""


class Kind(Enum):
    """Name how a metric's values go on: by the words of Prometheus, but for the last.

    STATES is a gauge per state: 1 for the one in force, 0 for the others.
    """

    GAUGE = "gauge"
    COUNTER = "counter"
    HISTOGRAM = "histogram"
    INFO = "info"
    STATES = "states"


class Why(Enum):
    """Say why a metric is missing."""

    SILENT = "silent"  # nobody has written the topic lately, or ever
    UNTOLD = "untold"  # the topic is fresh, and says nothing about it
    UNREADABLE = "unreadable"  # it could not be read on this computer, and it is told why


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
class Missing:
    """Say why a metric has no value; `text` is for people and may be long."""

    metric: str
    why: Why
    text: str


def number(told: Any) -> float | None:
    """Return a told number, a bool as 0 or 1, or None for anything else."""
    return float(told) if isinstance(told, bool | int | float) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """Declare one metric: its name in the field's conventions, and where its values are told.

    `name` ends with `unit`, and with `_total` where it is a counter. Each of `paths` leads through
    the document of `topic`; what they yield becomes a value by `take` and `scale`. `kept` metrics
    go to the history: gauges as they are, counters as what they gain per second.
    """

    name: str
    kind: Kind
    help: str
    topic: str
    paths: tuple[Path, ...]
    unit: str = ""
    scale: float = 1.0
    take: Callable[[Any], Value | None] = number
    states: tuple[str, ...] = ()
    state_label: str = "state"
    kept: bool = False

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the names of its labels."""
        own = (self.state_label,) if self.kind is Kind.STATES else ()
        return (*labels_of(self.paths[0]), *own)
