"""Tell from where the arms reach a point: straight ahead of the base, at a distance that suits."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

# Distance from the base's centre to the thing: best first, all within the arms' reach.
REACH_M: Final = (0.42, 0.46, 0.50, 0.54)
DIRECTIONS: Final = 36
LEAST_AHEAD_M: Final = 0.3
MOST_ASIDE_M: Final = 0.2
# Heights at which a hand that points down gets a grip, at some of these distances.
GRIP_HEIGHTS_M: Final = (0.25, 0.85)

IsFree = Callable[[float, float], bool]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """Place the base's centre on the floor at a distance from a thing, facing along a bearing."""

    x_m: float
    y_m: float
    bearing_rad: float
    reach_m: float
    step: int


def is_in_reach(point_m: Sequence[float]) -> bool:
    """Return whether the arms reach a point of the base frame from where the base stands."""
    x_m, y_m = point_m[0], point_m[1]
    return math.hypot(x_m, y_m) <= REACH_M[-1] and abs(y_m) <= MOST_ASIDE_M and x_m > LEAST_AHEAD_M


def stands_around(position_m: Sequence[float], is_free: IsFree) -> Iterator[Stand]:
    """Yield for each direction the free stand from which a point of the map is best reached."""
    for step in range(DIRECTIONS):
        bearing_rad = 2.0 * math.pi * step / DIRECTIONS
        for reach_m in REACH_M:
            x_m = position_m[0] - reach_m * math.cos(bearing_rad)
            y_m = position_m[1] - reach_m * math.sin(bearing_rad)
            if is_free(x_m, y_m):
                yield Stand(x_m=x_m, y_m=y_m, bearing_rad=bearing_rad, reach_m=reach_m, step=step)
                break
