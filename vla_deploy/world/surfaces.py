"""Remember the surfaces of the home: the same table has the same name whichever part is in view."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import cv2
import numpy as np

from vla_deploy.robots.description import Place
from vla_deploy.world.footprint import polygon_depth_m
from vla_deploy.world.thing import Surface

Point = tuple[float, float]

SAME_HEIGHT_M: Final = 0.02
# Two parts of one surface touch, but for what stands between them and hides it.
SAME_GAP_M: Final = 0.10
# The furniture that a place is for may be in view only in part.
NAMED_GAP_M: Final = 0.25
LEAST_HEIGHT_M: Final = 0.15
# A viewpoint stands this far before the middle of the furniture that it is for.
FURNITURE_AHEAD_M: Final = 0.5
MOST_SURFACES: Final = 24
CORNER_M: Final = 0.02


def furniture_points(places: Mapping[str, Place]) -> dict[str, Point]:
    """Return a point on each place's furniture, by the place's name.

    Of places that share it, such as a room and its table, it is that from whose pose it is seen.
    """
    points: dict[Point, tuple[float, str]] = {}
    for place in places.values():
        for view in place.viewpoints:
            x_m, y_m = view.outward(FURNITURE_AHEAD_M, 0.0)
            candidate = (view.distance_m(place.pose), place.name)
            at = (round(x_m, 2), round(y_m, 2))
            points[at] = min(points.get(at, candidate), candidate)
    return {name: at for at, (_, name) in points.items()}


class SurfaceBook:
    """Hold every surface seen so far, by name; `furniture` names points of those that have one.

    The floor, which is `floor_m` high, and what is little higher have none.
    """

    def __init__(
        self, furniture: Mapping[str, Point] | None = None, floor_m: float | None = 0.0
    ) -> None:
        self._furniture = furniture or {}
        self._least_m = -math.inf if floor_m is None else floor_m + LEAST_HEIGHT_M
        self._known: dict[str, Surface] = {}
        self._count = 0

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """Return the known surfaces, each as far as it has been seen."""
        return tuple(self._known.values())

    def look(self, height_m: float, polygon_m: Sequence[Point]) -> str:
        """Take in a part of a surface and return the surface's name."""
        part = Surface(name="", height_m=height_m, polygon_m=tuple(polygon_m))
        known = next((one for one in self._known.values() if _is_same(one, part)), None)
        if known is None:
            known = replace(part, name=self._new_name(part))
        # What was seen last goes to the end: the front is what may be forgotten.
        self._known.pop(known.name, None)
        outline = _hull((*known.polygon_m, *part.polygon_m))
        self._known[known.name] = replace(known, height_m=height_m, polygon_m=outline)
        while len(self._known) > MOST_SURFACES:
            del self._known[next(iter(self._known))]
        return known.name

    def _new_name(self, part: Surface) -> str:
        near = [
            (-polygon_depth_m(point, part.polygon_m), name)
            for name, point in self._furniture.items()
            if name not in self._known
        ]
        gap_m, name = min(near, default=(NAMED_GAP_M, ""))
        if gap_m < NAMED_GAP_M and part.height_m > self._least_m:
            return name
        self._count += 1
        return f"surface_{self._count}"


def _is_same(known: Surface, part: Surface) -> bool:
    if abs(known.height_m - part.height_m) > SAME_HEIGHT_M:
        return False
    pairs = ((known, part), (part, known))
    return any(
        polygon_depth_m(corner, one.polygon_m) > -SAME_GAP_M
        for one, other in pairs
        for corner in other.polygon_m
    )


def _hull(points: Sequence[Point]) -> tuple[Point, ...]:
    full = cv2.convexHull(np.array(points, dtype=np.float32))
    corners = cv2.approxPolyDP(full, CORNER_M, True).reshape(-1, 2)
    return tuple((float(x_m), float(y_m)) for x_m, y_m in corners)
