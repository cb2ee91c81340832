"""Count control's ticks, and say how many of them may be late."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

LATE_MARGIN_RATIO: Final = 0.01
"""So many more ticks may be late than before: other users of the computer come and go."""
LATE_FACTOR: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TickWatch:
    """Count control's ticks over a time, and how many of them came late."""

    ticks: int
    late: int

    @classmethod
    def of(cls, status: Mapping[str, Any]) -> "TickWatch":
        """Return what control has counted since it started, by its status."""
        return cls(ticks=int(status.get("tick", 0)), late=int(status.get("late_ticks", 0)))

    @property
    def late_ratio(self) -> float:
        """Return the late share; everything is late where nothing ticks."""
        return self.late / self.ticks if self.ticks > 0 else 1.0

    def since(self, before: "TickWatch") -> "TickWatch":
        """Return what came after `before`; a control that started anew counts from 0."""
        if self.ticks < before.ticks:
            return self
        return TickWatch(ticks=self.ticks - before.ticks, late=self.late - before.late)


def late_limit(before: TickWatch) -> float:
    """Return which share of ticks may be late, given the share before."""
    return max(LATE_FACTOR * before.late_ratio, before.late_ratio + LATE_MARGIN_RATIO)


def total(parts: Iterable[TickWatch]) -> TickWatch:
    """Return all ticks together."""
    counted = list(parts)
    return TickWatch(ticks=sum(one.ticks for one in counted), late=sum(one.late for one in counted))
