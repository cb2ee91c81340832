"""Tell what moves from what stands, in what a lidar sees beside the map.

Points close together are one cluster, two legs of a person too; a cluster that is found again near
where it is expected is followed, and moves when it has left where it was first seen.
"""

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.robots.floor_pose import Points

APART_M: Final = 0.35
"""Two legs of somebody who walks are nearer to each other."""
WIDEST_M: Final = 0.9
FOUND_WITHIN_M: Final = 0.5
LOST_NS: Final = NS_PER_S
GAIN: Final = 0.5
SPEED_GAIN: Final = 0.3
"""Of an alpha-beta filter at ten scans a second: legs swing, and their middle with them."""
MOVES_M_S: Final = 0.15
LEFT_M: Final = 0.3
BODY_M: Final = 0.5
"""What the camera sees of somebody is this near to the middle of their legs."""
TRAIL_NS: Final = 8 * NS_PER_S
"""As long as the depth camera's cells are kept: what it saw of somebody who has gone is no more."""
STANDS_NS: Final = 2 * NS_PER_S
"""What has stood still for so long is what stands there."""


class Mover(NamedTuple):
    """Hold where something that moves is in the map, and how fast it goes."""

    x_m: float
    y_m: float
    vx_m_s: float
    vy_m_s: float


@dataclass(slots=True, eq=False)
class _Track:
    at: Points
    velocity: Points
    first_at: Points
    stamp_ns: int
    moved_ns: int | None = None
    trail: list[tuple[int, Points]] = field(default_factory=list)

    def expected(self, stamp_ns: int) -> Points:
        return self.at + self.velocity * ((stamp_ns - self.stamp_ns) / NS_PER_S)

    def take(self, seen: Points, stamp_ns: int) -> None:
        gap_s = max(1e-3, (stamp_ns - self.stamp_ns) / NS_PER_S)
        expected = self.expected(stamp_ns)
        self.at = expected + GAIN * (seen - expected)
        self.velocity = self.velocity + SPEED_GAIN * (seen - expected) / gap_s
        self.stamp_ns = stamp_ns
        self.trail = [one for one in self.trail if stamp_ns - one[0] <= TRAIL_NS]
        self.trail.append((stamp_ns, self.at))
        has_left = math.dist(self.at, self.first_at) > LEFT_M
        if has_left and math.hypot(*self.velocity) > MOVES_M_S:
            self.moved_ns = stamp_ns
        elif self.moved_ns is not None and stamp_ns - self.moved_ns > STANDS_NS:
            self.moved_ns, self.first_at = None, self.at


class MoverTracks:
    """Follow clusters from scan to scan."""

    def __init__(self) -> None:
        self._tracks: list[_Track] = []
        self._gone: list[_Track] = []

    def see(self, points: Points, stamp_ns: int) -> tuple[Mover, ...]:
        """Take in the points of a scan that the map does not show; return what moves."""
        gone = [one for one in self._tracks if stamp_ns - one.stamp_ns > LOST_NS]
        self._tracks = [one for one in self._tracks if one not in gone]
        self._gone = [one for one in self._gone + gone if stamp_ns - one.stamp_ns <= TRAIL_NS]
        for middle in _middles(points):
            free = [one for one in self._tracks if one.stamp_ns != stamp_ns]
            away_m = [math.dist(one.expected(stamp_ns), middle) for one in free]
            if away_m and min(away_m) < FOUND_WITHIN_M:
                free[int(np.argmin(away_m))].take(middle, stamp_ns)
            else:
                self._tracks.append(_Track(middle, np.zeros(2), middle, stamp_ns))
        return tuple(
            Mover(*map(float, (*one.expected(stamp_ns), *one.velocity)))
            for one in self._tracks
            if one.moved_ns is not None
        )

    def left(self, stamp_ns: int) -> Points:
        """Return rows of stamp (ns), x, y: where what moves was, and is no more, in TRAIL_NS."""
        rows = [
            (stamp, *at.tolist())
            for one in self._tracks + self._gone
            if one.moved_ns is not None
            for stamp, at in one.trail
            if math.dist(at, one.expected(stamp_ns)) > LEFT_M + BODY_M
        ]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _middles(points: Points) -> list[Points]:
    """Return the middle of each cluster that is no wider than somebody."""
    names, middles = _clusters(points), []
    for name in np.unique(names):
        cluster = points[names == name]
        low, high = cluster.min(axis=0), cluster.max(axis=0)
        if math.dist(low, high) < WIDEST_M:
            middles.append((low + high) / 2.0)
    return middles


def _clusters(points: Points) -> NDArray[np.intp]:
    """Return for each point the name of its cluster: gaps in it are below APART_M."""
    names = np.arange(len(points))
    for index, point in enumerate(points):
        near = np.hypot(*(points[:index] - point).T) < APART_M
        names[np.isin(names, names[:index][near])] = index
    return names
