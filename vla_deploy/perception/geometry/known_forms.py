"""Find the pose in which a thing of known size has an outline that was seen on the table.

The outline of a thing on the plane below it is what its foot covers, and what its top hides: at the
height h, seen by a camera at the height H, a top looks larger by H / (H - h), and shifted away from
the camera. Both are convex, so that the outline is the hull of the two.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots.known_things import KnownThing
from vla_deploy.world.vocabulary import CONTAINERS

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

ROUND: Final = frozenset({"bowl", "cup", "can", "bottle"})
FOOT_RATIO: Final[Mapping[str, float]] = {"bowl": 0.65}
"""The width of a foot over that of the top; bowls lean outwards by some 25 degrees."""
WALL_M: Final = 0.003
CORNERS: Final = 24
# The search: first steps along x, y and the yaw, halved so often.
FIRST_STEPS: Final = (0.004, 0.004, 0.12)
HALVINGS: Final = 6
PASSES: Final = 3
_MM: Final = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FormPose:
    """Place a form on the table, with the share of both outlines in which they agree (IoU)."""

    x_m: float
    y_m: float
    yaw_rad: float
    agreement: float


@dataclass(frozen=True)
class KnownForm:
    """Hold the shape of a known thing that stands upright."""

    thing: KnownThing

    @property
    def height_m(self) -> float:
        """Return its height."""
        return self.thing.size_m[2]

    @cached_property
    def is_round(self) -> bool:
        """Return whether it looks the same from all sides."""
        return self.thing.class_name in ROUND

    @cached_property
    def is_hollow(self) -> bool:
        """Return whether it is open above."""
        return self.thing.class_name in CONTAINERS

    @cached_property
    def foot_ratio(self) -> float:
        """Return how wide its foot is, of its top."""
        return FOOT_RATIO.get(self.thing.class_name, 1.0)

    def outline(self, x_m: float, y_m: float, yaw_rad: float, camera: Array) -> Array:
        """Return the corners (n, 2) of what it covers of the table, seen by a camera (3,)."""
        middle = np.array((x_m, y_m))
        cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
        top = self._rim @ np.array(((cosine, sine), (-sine, cosine)))
        larger = camera[2] / (camera[2] - self.height_m)
        hidden = camera[:2] + larger * (top + middle - camera[:2])
        both = np.vstack((hidden, self.foot_ratio * top + middle))
        hull: Array = cv2.convexHull(both.astype(np.float32)).reshape(-1, 2).astype(np.float64)
        return hull

    def contains(self, xy: Array, height_m: float) -> Mask:
        """Return which points (n, 2) of the thing's own frame are in it, at a height."""
        width = self.foot_ratio + (1.0 - self.foot_ratio) * height_m / self.height_m
        within = self._within(xy, width, 0.0)
        if self.is_hollow and height_m > WALL_M:
            within &= ~self._within(xy, width, WALL_M)
        return within

    def find(self, seen: Array, camera: Array) -> FormPose:
        """Return the pose in which the outline fits one that was seen best: (n, 2) corners."""
        return _Search(self, seen, camera).best()

    @cached_property
    def _rim(self) -> Array:
        length_m, width_m, _ = self.thing.size_m
        if self.is_round:
            angles = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
            directions = np.column_stack((np.cos(angles), np.sin(angles)))
            return 0.5 * directions * (length_m, width_m)
        return 0.5 * np.array(((1, 1), (-1, 1), (-1, -1), (1, -1))) * (length_m, width_m)

    def _within(self, xy: Array, width_ratio: float, inwards_m: float) -> Mask:
        half = 0.5 * width_ratio * np.array(self.thing.size_m[:2]) - inwards_m
        if np.any(half <= 0.0):
            return np.zeros(len(xy), dtype=np.bool_)
        inside: Mask
        if self.is_round:
            inside = ((xy / half) ** 2).sum(axis=1) <= 1.0
        else:
            inside = np.all(np.abs(xy) <= half, axis=1)
        return inside


class _Search:
    """Move and turn a form until its outline covers the one that was seen."""

    def __init__(self, form: KnownForm, seen: Array, camera: Array) -> None:
        self._form = form
        self._camera = camera
        self._around = seen.mean(axis=0)
        self._seen = self._local(seen)
        self._area = float(cv2.contourArea(self._seen))
        self._first = self._start(seen)

    def best(self) -> FormPose:
        place = list(self._first)
        agreement = self._agreement(place)
        axes = range(2 if self._form.is_round else 3)
        for halving in range(HALVINGS):
            for _ in range(PASSES):
                before = agreement
                for axis in axes:
                    step = FIRST_STEPS[axis] / 2**halving
                    for moved in (step, -step):
                        tried = [*place[:axis], place[axis] + moved, *place[axis + 1 :]]
                        found = self._agreement(tried)
                        if found > agreement:
                            place, agreement = tried, found
                if agreement == before:
                    break
        x_m, y_m, yaw_rad = place
        return FormPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad, agreement=agreement)

    def _start(self, seen: Array) -> tuple[float, float, float]:
        """Begin where the middle of the outline would be that of foot and top."""
        (x_mm, y_mm), (first, second), angle_deg = cv2.minAreaRect(self._seen)
        middle = np.array((x_mm, y_mm)) / _MM + self._around
        larger = self._camera[2] / (self._camera[2] - self._form.height_m)
        x_m, y_m = self._camera[:2] + (middle - self._camera[:2]) / (0.5 * (1.0 + larger))
        length_m, width_m, _ = self._form.thing.size_m
        turn_deg = angle_deg if (first >= second) == (length_m >= width_m) else angle_deg + 90.0
        return float(x_m), float(y_m), math.radians(turn_deg)

    def _agreement(self, place: list[float]) -> float:
        x_m, y_m, yaw_rad = place
        outline = self._local(self._form.outline(x_m, y_m, yaw_rad, self._camera))
        shared, _ = cv2.intersectConvexConvex(self._seen, outline)
        return float(shared / (self._area + cv2.contourArea(outline) - shared))

    def _local(self, corners: Array) -> Floats:
        """Return corners in mm around the middle: OpenCV computes in single precision."""
        local: Floats = ((corners - self._around) * _MM).astype(np.float32)
        return local
