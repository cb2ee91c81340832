"""Count how long things take in fixed buckets, for telemetry of a loop that never stops.

Each power of two is cut into eight equal buckets, so that a percentile is at most 1/8 too high.
"""

from bisect import bisect_left
from itertools import accumulate
from typing import Any, Final

from drivers.clock import NS_PER_S

_SUB_BITS: Final = 3
_WHOLE_BITS: Final = _SUB_BITS + 1
_SUB_BUCKETS: Final = 1 << _SUB_BITS
_LAST_OCTAVE: Final = 36  # 2^36 ns is 69 s; what takes longer is counted there
_BUCKETS: Final = (_LAST_OCTAVE - _SUB_BITS + 1) * _SUB_BUCKETS
_TOLD_OCTAVES: Final = range(18, 28)  # 0.26 ms to 0.13 s, where a bus' answers lie
_TOLD_BOUNDS_S: Final = [(1 << octave) / NS_PER_S for octave in _TOLD_OCTAVES]
_TOLD_ENDS: Final = [(octave - _SUB_BITS + 1) * _SUB_BUCKETS for octave in _TOLD_OCTAVES]


class LatencyHistogram:
    """Hold counts by duration; `record` costs a few integer operations and allocates nothing."""

    def __init__(self) -> None:
        self.total_ns = 0
        self.max_ns = 0
        self._buckets = [0] * _BUCKETS

    def record(self, latency_ns: int) -> None:
        """Count one duration; a negative one counts as zero."""
        if latency_ns < _SUB_BUCKETS:
            latency_ns = index = latency_ns if latency_ns > 0 else 0
        else:
            shift = latency_ns.bit_length() - _WHOLE_BITS
            index = (shift << _SUB_BITS) + (latency_ns >> shift)
        self.total_ns += latency_ns
        if latency_ns > self.max_ns:
            self.max_ns = latency_ns
        self._buckets[index if index < _BUCKETS else -1] += 1

    @property
    def count(self) -> int:
        """Return how many durations were recorded."""
        return sum(self._buckets)

    @property
    def mean_ns(self) -> float:
        """Return the mean, 0 before the first duration."""
        count = self.count
        return self.total_ns / count if count else 0.0

    def percentile_ns(self, ratio: float) -> int:
        """Return a duration that at least `ratio` of the counted ones do not exceed.

        Raises:
            ValueError: the ratio is not within 0..1.
        """
        if not 0.0 <= ratio <= 1.0:
            raise ValueError(f"percentile ratio must be within 0..1, got {ratio}")
        return self._percentile_ns(ratio, self._totals())

    def reset(self) -> None:
        """Start over, as for the next telemetry period."""
        self.total_ns = self.max_ns = 0
        self._buckets[:] = [0] * _BUCKETS

    def as_dict(self) -> dict[str, Any]:
        """Return count, sum, mean, p50, p99 and max in seconds, and counts by octave.

        `counts` has for each upper bound of `le_s` how many durations lie below it.
        """
        totals = self._totals()
        count = totals[-1]
        return {
            "count": count,
            "sum_s": round(self.total_ns / NS_PER_S, 6),
            "mean_s": round(self.total_ns / max(count, 1) / NS_PER_S, 7),
            "p50_s": round(self._percentile_ns(0.5, totals) / NS_PER_S, 7),
            "p99_s": round(self._percentile_ns(0.99, totals) / NS_PER_S, 7),
            "max_s": round(self.max_ns / NS_PER_S, 7),
            "le_s": _TOLD_BOUNDS_S,
            "counts": [totals[index - 1] for index in _TOLD_ENDS],
        }

    def _totals(self) -> list[int]:
        """Return for each bucket how many durations it and those before it hold."""
        return list(accumulate(self._buckets))

    def _percentile_ns(self, ratio: float, totals: list[int]) -> int:
        index = bisect_left(totals, max(ratio * totals[-1], 1))
        return self.max_ns if index >= _BUCKETS else min(_upper_ns(index), self.max_ns)


def _upper_ns(index: int) -> int:
    """Return the largest duration that falls into a bucket."""
    if index < 2 * _SUB_BUCKETS:
        return index
    shift = (index >> _SUB_BITS) - 1
    return (((index & (_SUB_BUCKETS - 1)) + _SUB_BUCKETS + 1) << shift) - 1
