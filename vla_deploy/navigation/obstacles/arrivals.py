"""Tell who is newly there: of what moves, each once for as long as they stay.

Nobody is known by face. Who is out of sight for a while, and comes back, is new again.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Points

SAME_M: Final = 0.6
"""So far somebody gets from one scan to the next, as the lidar sees legs."""
ASTRAY_M_S: Final = 1.0
"""How fast the place of somebody who is out of sight becomes unsure."""
TWO_M: Final = 0.45
"""Two people are further apart; nearer to somebody is a leg of theirs."""
STANDS_M_S: Final = 0.3
"""Slower than this when they were last seen to move, and they have not walked away."""
SURE_NS: Final = 3 * NS_PER_S // 10
"""So long something moves before it is taken for somebody."""
GONE_NS: Final = 5 * NS_PER_S
CELL_M: Final = 0.1
"""What stood there stands there still where this near to it something does."""


@dataclass(slots=True, eq=False)
class _Somebody:
    at: Points
    velocity: Points
    first_ns: int
    seen_ns: int
    is_told: bool

    def gap_s(self, stamp_ns: int) -> float:
        return (stamp_ns - self.seen_ns) / NS_PER_S

    def expected(self, stamp_ns: int) -> Points:
        return self.at + self.velocity * min(1.0, self.gap_s(stamp_ns))

    def may_be_at(self, stamp_ns: int) -> float:
        """Return how far from where they are expected they may be."""
        return SAME_M + ASTRAY_M_S * self.gap_s(stamp_ns)


class Arrivals:
    """Know who is there from scan to scan, beginning with what stands there already."""

    def __init__(self, standing: Points) -> None:
        """Take in what is there that is not on the map, (n, 2): of it nobody comes in."""
        self._stood = standing
        self._known: list[_Somebody] = []

    def see(
        self, points: Points, movers: NDArray[np.float64], stamp_ns: int
    ) -> list[tuple[float, float]]:
        """Take in what is seen beside the map, and rows of x, y, vx, vy; return who is new."""
        new = dict(enumerate(movers))
        for one, row in self._matches(movers, stamp_ns):
            one.at, one.velocity, one.seen_ns = movers[row, :2], movers[row, 2:], stamp_ns
            del new[row]
        self._known = [one for one in self._known if self._is_there(one, points, stamp_ns)]
        for row in new.values():
            if all(math.dist(one.at, row[:2]) > TWO_M for one in self._known):
                has_stood = self._has_stood(row[:2], points)
                self._known.append(_Somebody(row[:2], row[2:], stamp_ns, stamp_ns, has_stood))
        return [(float(one.at[0]), float(one.at[1])) for one in self._told_now(stamp_ns)]

    def _told_now(self, stamp_ns: int) -> Iterator[_Somebody]:
        for one in self._known:
            if not one.is_told and one.seen_ns == stamp_ns and stamp_ns - one.first_ns >= SURE_NS:
                one.is_told = True
                yield one

    def _matches(
        self, movers: NDArray[np.float64], stamp_ns: int
    ) -> Iterator[tuple[_Somebody, int]]:
        """Yield who is which of the movers, the nearest first, each once."""
        pairs = sorted(
            (away_m, number, row)
            for number, one in enumerate(self._known)
            for row, mover in enumerate(movers)
            if (away_m := math.dist(one.expected(stamp_ns), mover[:2])) < one.may_be_at(stamp_ns)
        )
        known, rows = set(range(len(self._known))), set(range(len(movers)))
        for _, number, row in pairs:
            if number in known and row in rows:
                known.discard(number)
                rows.discard(row)
                yield self._known[number], row

    def _is_there(self, one: _Somebody, points: Points, stamp_ns: int) -> bool:
        """Return whether somebody is there still: they move, stand, or were seen a moment ago."""
        is_still = one.seen_ns < stamp_ns and math.hypot(*one.velocity) < STANDS_M_S
        if is_still and np.hypot(*(points - one.at).T).min(initial=math.inf) < TWO_M:
            one.seen_ns = stamp_ns
        return stamp_ns - one.seen_ns < GONE_NS

    def _has_stood(self, at: Points, points: Points) -> bool:
        """Return whether what moves there now stood there from the beginning."""
        if not len(self._stood):
            return False
        near = self._stood[np.hypot(*(self._stood - at).T) < SAME_M]
        if not len(near):
            return False
        away_m = np.linalg.norm(near[:, None] - points[None], axis=2).min(axis=1, initial=math.inf)
        return bool((away_m > CELL_M).mean() > 0.5)
