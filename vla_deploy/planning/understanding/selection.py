"""Pick among things by how they stand to who looks, or by how large they are: pure geometry."""

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


def in_place(
    things: Sequence[Thing], number: int, side: str, view: Viewpoint | None
) -> list[Thing]:
    """Return the thing at a place in a row, counted from 1 from a side, -1 for its end.

    None where the row is too short, all of them where there is no row.
    """
    if len(things) < max(number, 1):
        return []
    row = in_a_row(_together(things, number) or (), view) if side else None
    if row is None:
        return list(things)
    row = row[::-1] if side == "right" else row
    at = number - 1 if number > 0 else number
    return [row[at]] if number <= len(row) else []


def on_side(things: Sequence[Thing], side: str, view: Viewpoint | None) -> list[Thing]:
    """Return the leftmost, rightmost or middle thing; all of them where that tells none apart.

    Where several stand on one piece of furniture and the others apart, those are the row.
    """
    row = in_a_row(_together(things, 2) or things, view)
    if row is None or (side == "middle" and len(row) % 2 == 0):
        return list(things)
    place = {"left": 0, "right": -1, "middle": len(row) // 2}[side]
    return [row[place]]


def _together(things: Sequence[Thing], least: int) -> list[Thing] | None:
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


def in_a_row(things: Sequence[Thing], view: Viewpoint | None) -> list[Thing] | None:
    """Return things from left to right as they are seen, None where they are not side by side."""
    if view is None or len(things) < 2:
        return None
    row = sorted(things, key=lambda thing: -_bearing_rad(thing, view))
    bearings = [_bearing_rad(thing, view) for thing in row]
    apart = all(left - right > LEAST_BEARING_RAD for left, right in pairwise(bearings))
    return row if apart else None


def _bearing_rad(thing: Thing, view: Viewpoint) -> float:
    """Return how far to the left of straight ahead a thing is seen."""
    angle = math.atan2(thing.xy_m[1] - view.y_m, thing.xy_m[0] - view.x_m) - view.yaw_rad
    return math.atan2(math.sin(angle), math.cos(angle))


def by_distance(things: Sequence[Thing], here: tuple[float, float]) -> list[Thing]:
    """Return things from the nearest to a point to the farthest."""
    return sorted(things, key=lambda thing: math.dist(thing.xy_m, here))


def most(things: Sequence[Thing], word: str) -> list[Thing]:
    """Return the biggest, smallest, tallest thing; those that do not differ from it too."""
    measure, sign = MEASURES[word]
    ranked = sorted(things, key=lambda thing: sign * measure(thing), reverse=True)
    return [one for one in ranked if _is_as_large(measure(one), measure(ranked[0]))]


def _is_as_large(one: float, other: float) -> bool:
    return max(one, other) < DIFFERENCE_RATIO * max(min(one, other), 1e-3)


def _edge_m(thing: Thing) -> float:
    """Return the edge of the cube that is as large."""
    return math.prod(thing.size_m) ** (1.0 / 3.0)


# The measure of which a superlative means the most, or the least.
MEASURES: Final[Mapping[str, tuple[Callable[[Thing], float], int]]] = MappingProxyType(
    {
        "big": (_edge_m, 1),
        "small": (_edge_m, -1),
        "tall": (lambda thing: thing.size_m[2], 1),
        "short": (lambda thing: thing.size_m[2], -1),
        "long": (lambda thing: max(thing.size_m[:2]), 1),
        "high": (lambda thing: thing.top_m, 1),
        "low": (lambda thing: thing.top_m, -1),
        "wide": (lambda thing: max(thing.size_m[:2]), 1),
        "narrow": (lambda thing: max(thing.size_m[:2]), -1),
        "thick": (lambda thing: min(thing.size_m), 1),
        "thin": (lambda thing: min(thing.size_m), -1),
    }
)
