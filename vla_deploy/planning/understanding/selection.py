"""Pick among things that fit an expression: by side, by extreme, by what was spoken of before."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Final

from vla_deploy.world import Thing, Viewpoint

# Things whose bearings differ by less stand one behind the other, not side by side.
LEAST_BEARING_RAD: Final = 0.03
# Below this ratio two things look the same size.
DIFFERENCE_RATIO: Final = 1.08
# What is farther off the line between two things is not between them.
MOST_OFF_RATIO: Final = 0.4
Measure = Callable[[Thing], float]


def _volume(thing: Thing) -> float:
    return thing.size_m[0] * thing.size_m[1] * thing.size_m[2]


# The measure of which a superlative means the most.
MEASURES: Final[Mapping[str, Measure]] = MappingProxyType(
    {
        "big": lambda thing: _volume(thing) ** (1.0 / 3.0),
        "small": lambda thing: 1.0 / max(_volume(thing) ** (1.0 / 3.0), 1e-3),
        "tall": lambda thing: thing.size_m[2],
        "short": lambda thing: 1.0 / max(thing.size_m[2], 1e-3),
        "long": lambda thing: max(thing.size_m[:2]),
        "high": lambda thing: thing.top_m,
        "low": lambda thing: 1.0 / max(thing.top_m, 1e-3),
        "wide": lambda thing: max(thing.size_m[:2]),
        "narrow": lambda thing: 1.0 / max(*thing.size_m[:2], 1e-3),
        "thick": lambda thing: min(thing.size_m),
        "thin": lambda thing: 1.0 / max(min(thing.size_m), 1e-3),
    }
)


def off_line_m(thing: Thing, one: Thing, other: Thing) -> float | None:
    """Return how far a thing is off the line between two others; None if it is not between them."""
    (x, y), (x1, y1), (x2, y2) = thing.xy_m, one.xy_m, other.xy_m
    length_m = math.dist(one.xy_m, other.xy_m)
    if length_m == 0.0:
        return None
    along_ratio = ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / length_m**2
    off_m = abs((x - x1) * (y2 - y1) - (y - y1) * (x2 - x1)) / length_m
    is_between = 0.0 < along_ratio < 1.0 and off_m <= MOST_OFF_RATIO * length_m
    return off_m if is_between else None


def bearing_rad(thing: Thing, view: Viewpoint) -> float:
    """Return how far to the left of straight ahead a thing is seen."""
    angle = math.atan2(thing.xy_m[1] - view.y_m, thing.xy_m[0] - view.x_m) - view.yaw_rad
    return math.atan2(math.sin(angle), math.cos(angle))


def in_a_row(things: Sequence[Thing], view: Viewpoint | None) -> list[Thing] | None:
    """Return things from left to right as they are seen, None where they are not side by side."""
    if view is None or len(things) < 2:
        return None
    row = sorted(things, key=lambda thing: -bearing_rad(thing, view))
    bearings = [bearing_rad(thing, view) for thing in row]
    apart = all(left - right > LEAST_BEARING_RAD for left, right in pairwise(bearings))
    return row if apart else None


def on_side(things: Sequence[Thing], side: str, view: Viewpoint | None) -> list[Thing]:
    """Return the leftmost, rightmost or middle thing; all of them where that tells none apart.

    Where several stand on one piece of furniture and the others apart, those are the row.
    """
    row = in_a_row(together(things, 2) or things, view)
    if row is None or (side == "middle" and len(row) % 2 == 0):
        return list(things)
    place = {"left": 0, "right": -1, "middle": len(row) // 2}[side]
    return [row[place]]


def most(things: Sequence[Thing], word: str) -> list[Thing]:
    """Return the biggest, smallest, tallest thing; those that do not differ from it too."""
    measure = MEASURES[word]
    ranked = sorted(things, key=measure, reverse=True)
    if not ranked:
        return []
    top = measure(ranked[0])
    return [one for one in ranked if measure(one) * DIFFERENCE_RATIO > top]


def nth(things: Sequence[Thing], place: int) -> list[Thing]:
    """Return the one thing at a place in a row, counted from 1; none where the row is shorter."""
    return [things[place - 1 if place > 0 else place]] if place <= len(things) else []


def together(things: Sequence[Thing], least: int) -> list[Thing] | None:
    """Return what stands in one row: on one support, or on the only one that has enough of them.

    None where that leaves several rows, or none that is long enough.
    """
    groups: dict[str, list[Thing]] = {}
    for one in things:
        groups.setdefault(one.rests.of if one.rests else "", []).append(one)
    if len(groups) == 1:
        return list(things)
    large = [group for group in groups.values() if len(group) >= max(least, 2)]
    return large[0] if len(large) == 1 else None


def ranked(things: Sequence[Thing], word: str) -> list[Thing] | None:
    """Return things from the biggest, tallest ... on; None where two of them do not differ."""
    measure = MEASURES[word]
    row = sorted(things, key=measure, reverse=True)
    differ = all(measure(one) > DIFFERENCE_RATIO * measure(other) for one, other in pairwise(row))
    return row if differ else None


def by_distance(things: Sequence[Thing], here: tuple[float, float]) -> list[Thing]:
    """Return things from the nearest to a point to the farthest."""
    return sorted(things, key=lambda thing: math.dist(thing.xy_m, here))


def facing(view: Viewpoint) -> Viewpoint:
    """Return who stands before the robot and faces it: left and right are the other way round."""
    return Viewpoint(
        x_m=view.x_m + 2.0 * math.cos(view.yaw_rad),
        y_m=view.y_m + 2.0 * math.sin(view.yaw_rad),
        yaw_rad=view.yaw_rad + math.pi,
        name="speaker",
    )
