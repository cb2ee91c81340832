"""Count how far apart ticks begin, as shares of the period that was in force."""

from bisect import bisect_left
from typing import Final

from vla_deploy.ipc.payloads.motion import TickPeriodCounts

LATE_RATIO: Final = 1.2
"""A tick is late when more than this many periods lie between its begin and the last one's."""

BOUNDS_RATIO: Final = (0.5, 0.8, 0.9, 0.95, 1.05, 1.1, LATE_RATIO, 1.5, 2.0, 3.0, 5.0, 10.0)


class TickPeriods:
    """Hold counts by upper bound, the last for what is beyond all; counting allocates nothing."""

    def __init__(self) -> None:
        self._counts = [0] * (len(BOUNDS_RATIO) + 1)
        self._sum_ratio = 0.0

    def count(self, ratio: float) -> None:
        """Count one period; what equals a bound lies below it."""
        self._counts[bisect_left(BOUNDS_RATIO, ratio)] += 1
        self._sum_ratio += ratio

    @property
    def late(self) -> int:
        """Return how many were late."""
        return sum(self._counts[BOUNDS_RATIO.index(LATE_RATIO) + 1 :])

    def document(self) -> TickPeriodCounts:
        """Return bounds, counts between them, and the sum of all, for `control_status`."""
        return {
            "le": BOUNDS_RATIO,
            "counts": self._counts,
            "sum": round(self._sum_ratio, 3),
        }
