"""Describe where the hands of a robot take things, and put them down, in its base frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """Say where hands that point straight down take things; x forward, y left, in metres.

    `distances_m` are those from the base's middle to a thing, best first; one on wheels stands at
    one of them. `least_ahead_m` is x, `most_aside_m` |y|; `grip_heights_m` are the lowest and the
    highest grip, at some of the distances. A hand that is further in front than `out_m` is above
    what stands there, and is at `clear_height_m` before it travels. It comes down on things from
    `above_m` over them at least, puts things down at `put_ahead_m` and, on its own side,
    `put_aside_m`, the best first, and leaves `apart_m` between the middle of what it puts down and
    the outline of what stands there: half a hand.
    """

    distances_m: tuple[float, ...]
    least_ahead_m: float
    most_aside_m: float
    grip_heights_m: tuple[float, float]
    clear_height_m: float
    out_m: float
    above_m: float
    put_ahead_m: tuple[float, ...]
    put_aside_m: tuple[float, ...]
    apart_m: float

    def has(self, point_m: Sequence[float]) -> bool:
        """Return whether a point of the base frame is within reach from where the base stands."""
        x_m, y_m = point_m[0], point_m[1]
        is_near = math.hypot(x_m, y_m) <= max(self.distances_m)
        return is_near and abs(y_m) <= self.most_aside_m and x_m > self.least_ahead_m

    def height_refusal(self, height_m: float) -> str:
        """Say why a grip at that height is out of reach, "" where it is not."""
        low_m, high_m = self.grip_heights_m
        if low_m <= height_m <= high_m:
            return ""
        return f"its grip would be {height_m:.2f} m high, hands reach {low_m:g} to {high_m:g} m"
