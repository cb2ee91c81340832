"""Give depth to the images of a camera that measures none: by the table plane and known sizes.

The table is z = 0 of the base frame. What has its colour lies on it; what has not is a thing. A
thing whose outline fits a known size stands where that size says; any other one is an obstacle of
unknown height. Where a thing cannot be judged, because the robot's body or the image's border hides
a part of it, there is no depth: what is known of that place stays as it is.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.perception.geometry.cloud import Floats, Mask, PosedImage
from vla_deploy.perception.geometry.known_forms import Array, FormPose, KnownForm
from vla_deploy.perception.geometry.lens import ray_table
from vla_deploy.perception.geometry.table_colour import TableColour, to_lab
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.perception.naming.colour import colour_names
from vla_deploy.robots.known_things import KnownThing
from vla_deploy.robots.reach import Reach

# So far beyond the reach the table's colour is learned, and things are looked for.
COLOUR_MARGIN_M: Final = 0.06
THING_MARGIN_M: Final = 0.16
LEAST_CAMERA_HEIGHT_M: Final = 0.2
MOST_HEIGHT_RATIO: Final = 0.7
"""Of the camera's height: what is higher is too near to it."""
LEAST_VIEW_RATIO: Final = 0.1
"""Share of the image that must show the reach."""
LEAST_TABLE_RATIO: Final = 0.5
"""Share of the reach, as far as the robot does not hide it, that must have the table's colour."""
MIN_PIXELS: Final = 20
HIDDEN_PX: Final = 3
LEAST_AGREEMENT: Final = 0.8
"""Of the outline of a thing with that of a known one; the rest is a pixel around the edge."""
PART_AGREEMENT: Final = 0.88
"""Of a thing that touches another one in the image, which may hide a part of it."""
CLEAR_LEAD: Final = 0.03
"""Two forms that agree equally well and differ by more in height leave the height unknown."""
SAME_HEIGHT_M: Final = 0.004
EDGE_RATIO: Final = 0.5
"""Of the contrast of a thing with the table: an edge lies where half of a pixel is covered."""
LEAST_SOLIDITY: Final = 0.8
"""Of an outline: the share of its hull that it fills."""
PART_SHARE: Final = 0.15
UNKNOWN_HEIGHT_M: Final = 0.01
"""Shown of what fits no known size, so that it is an obstacle and not table."""
LEVEL_M: Final = 0.001
MOST_LEVELS: Final = 64
CONTENTS_LEVELS: Final = 12.0
SHADED: Final = np.array((0.5, 1.0, 1.0), np.float32)
"""Weights of a colour in a container, whose walls shade its bottom."""
LEAST_SLOPE: Final = 1e-6

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownSight:
    """Say which class the thing in a box of the image (left, top, right, bottom) has."""

    class_name: str
    box_px: tuple[int, int, int, int]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TableImage:
    """Hold an image with depth, and what was recognised; with `faults` the depth is none."""

    image: PosedImage
    sights: tuple[KnownSight, ...] = ()
    faults: tuple[str, ...] = ()


class PlaneDepth:
    """Give depth to images of the table within a reach, by things of known size."""

    def __init__(self, reach: Reach, things: Sequence[KnownThing]) -> None:
        self._reach = reach
        self._forms = [KnownForm(thing) for thing in things]
        self._plane: _PlaneView | None = None

    def of(self, image: PosedImage) -> TableImage:
        """Return an image with depth; its own depth is not looked at."""
        if self._plane is None or not self._plane.is_of(image):
            self._plane = _PlaneView.of(image)  # the same for all images of a camera that stands
        plane = self._plane
        near = self._within(plane, COLOUR_MARGIN_M)
        fault = _pose_fault(plane, near)
        if fault:
            return TableImage(image=image, faults=(fault,))
        lab = to_lab(image.rgb)
        table = TableColour.of(lab, near & ~image.body)
        if table.ratio < LEAST_TABLE_RATIO:
            fault = (
                f"table covered: {table.ratio:.2f} of the reach has the table's colour, least "
                f"{LEAST_TABLE_RATIO:g} (clear the table)"
            )
            return TableImage(image=image, faults=(fault,))
        scene = _Drawing(image, plane, lab, self._within(plane, THING_MARGIN_M))
        contrast = table.contrast(lab)
        foreign = (contrast > table.limit) & scene.looked_at & ~image.body
        for blob in _blobs(foreign):
            self._add(_sharpened(blob, contrast), scene)
        return TableImage(image=replace(image, depth_m=scene.depth_m), sights=tuple(scene.sights))

    def _within(self, plane: "_PlaneView", margin_m: float) -> Mask:
        x, y = plane.x_m, plane.y_m
        reach = self._reach
        within: Mask = np.hypot(x, y) <= max(reach.distances_m) + margin_m
        within &= (np.abs(y) <= reach.most_aside_m + margin_m) & (x > reach.least_ahead_m)
        return within & plane.hits

    def _add(self, blob: Mask, scene: "_Drawing") -> None:
        if scene.is_cut_off(blob):
            scene.hide(blob)
            return
        found = self._recognise(blob, scene, LEAST_AGREEMENT)
        if found is not None:
            scene.draw(*found)
            return
        parts = list(_parts_by_colour(blob, scene.image.rgb))
        fits = [self._recognise(part, scene, PART_AGREEMENT) for part in parts]
        if len(parts) > 1 and all(fits):
            for one in fits:
                assert one is not None
                scene.draw(*one)
        else:
            scene.raise_unknown(blob)

    def _recognise(
        self, blob: Mask, scene: "_Drawing", least: float
    ) -> tuple[KnownForm, FormPose] | None:
        """Return the known form that an outline has, None where none or more than one fits."""
        seen, solidity = scene.outline_of(blob)
        if solidity < LEAST_SOLIDITY:
            return None
        camera = scene.plane.camera
        low = (one for one in self._forms if one.height_m < MOST_HEIGHT_RATIO * camera[2])
        fits = [(form, form.find(seen, camera)) for form in low]
        fits = [one for one in fits if one[1].agreement >= least]
        fits.sort(key=lambda one: -one[1].agreement)
        if not fits:
            return None
        form, pose = fits[0]
        is_doubtful = any(
            fit.agreement > pose.agreement - CLEAR_LEAD
            and abs(other.height_m - form.height_m) > SAME_HEIGHT_M
            for other, fit in fits[1:]
        )
        return None if is_doubtful else (form, pose)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _PlaneView:
    """Hold the ray of each pixel in the base frame, and where it meets the table.

    `rays` are (h, w, 3) per unit of depth.
    """

    lens: Intrinsics
    base_from_camera: Array
    rays: Array
    hits: Mask
    x_m: Array
    y_m: Array

    @classmethod
    def of(cls, image: PosedImage) -> "_PlaneView":
        flat = ray_table(image.camera).astype(np.float64)
        ahead = np.concatenate((flat, np.ones((*flat.shape[:2], 1))), axis=2)
        rays = ahead @ image.base_from_camera[:3, :3].T
        camera = image.base_from_camera[:3, 3]
        hits = rays[..., 2] < -LEAST_SLOPE
        depth = np.where(hits, -camera[2] / np.where(hits, rays[..., 2], -1.0), 0.0)
        return cls(
            lens=image.camera,
            base_from_camera=image.base_from_camera,
            rays=rays,
            hits=hits & (depth > 0.0),
            x_m=camera[0] + rays[..., 0] * depth,
            y_m=camera[1] + rays[..., 1] * depth,
        )

    @property
    def camera(self) -> Array:
        """Return where the rays begin (3,)."""
        position: Array = self.base_from_camera[:3, 3]
        return position

    def is_of(self, image: PosedImage) -> bool:
        """Return whether an image was taken from the same place with the same lens."""
        same_lens = self.lens == image.camera
        return same_lens and np.array_equal(self.base_from_camera, image.base_from_camera)

    def corners_of(self, rows: Indices, columns: Indices) -> Array:
        """Return the corners (n, 2) on the table of some pixels, none of them at the border."""
        return np.vstack(
            [self._between(rows, columns, down, across) for down in (-1, 1) for across in (-1, 1)]
        )

    def _between(self, rows: Indices, columns: Indices, down: int, across: int) -> Array:
        """Return the middle (n, 2) of pixels and the three next to one of their corners."""
        beside, above = columns + across, rows + down
        at = np.stack((rows, above, rows, above)), np.stack((columns, columns, beside, beside))
        return np.column_stack((self.x_m[at].mean(axis=0), self.y_m[at].mean(axis=0)))

    def depth_to(self, height_m: float, at: Mask) -> Array:
        """Return the depth at which some pixels' rays are at a height."""
        depth: Array = (height_m - self.camera[2]) / self.rays[at][:, 2]
        return depth


class _Drawing:
    """Draw things into the depth of an image that shows a bare table."""

    def __init__(self, image: PosedImage, plane: _PlaneView, lab: Floats, looked_at: Mask) -> None:
        self.image = image
        self.plane = plane
        self.looked_at = looked_at
        self.sights: list[KnownSight] = []
        self.depth_m: Floats = np.zeros(looked_at.shape, dtype=np.float32)
        self.depth_m[looked_at] = plane.depth_to(0.0, looked_at)
        self._lab = lab
        # A thing that begins at the edge of what is judged may go on beyond it.
        beyond = ~looked_at | image.body
        beyond[[0, -1]] = beyond[:, [0, -1]] = True
        self._beyond = _grown(beyond, HIDDEN_PX)

    def is_cut_off(self, blob: Mask) -> bool:
        """Return whether the border of what is judged, or the robot, may hide a part of it."""
        return bool(np.any(blob & self._beyond))

    def hide(self, blob: Mask) -> None:
        """Say nothing of a place."""
        self.depth_m[_grown(blob, 1)] = 0.0

    def raise_unknown(self, blob: Mask) -> None:
        """Show something of unknown height."""
        self.depth_m[blob] = self.plane.depth_to(UNKNOWN_HEIGHT_M, blob)
        self.sights.append(KnownSight(class_name=OTHER, box_px=_box(blob)))

    def outline_of(self, blob: Mask) -> tuple[Array, float]:
        """Return the hull (n, 2) of a blob on the table, and the share of it that is filled."""
        contours, _ = cv2.findContours(
            blob.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
        )
        contour = max(contours, key=len).reshape(-1, 2)
        filled = cv2.contourArea(contour) / max(1.0, cv2.contourArea(cv2.convexHull(contour)))
        xy = self.plane.corners_of(contour[:, 1], contour[:, 0])
        middle = xy.mean(axis=0)
        hull = cv2.convexHull(((xy - middle) * 1000.0).astype(np.float32)).reshape(-1, 2)
        return hull.astype(np.float64) / 1000.0 + middle, filled

    def draw(self, form: KnownForm, pose: FormPose) -> None:
        """Draw a known thing: for each pixel where its ray meets it first, from above."""
        middle = np.array((pose.x_m, pose.y_m))
        outline = form.outline(pose.x_m, pose.y_m, pose.yaw_rad, self.plane.camera)
        (x_min, y_min), (x_max, y_max) = outline.min(axis=0), outline.max(axis=0)
        x, y = self.plane.x_m, self.plane.y_m
        at = self.looked_at & (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
        rays, cosine, sine = self.plane.rays[at], math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        turn = np.array(((cosine, -sine), (sine, cosine)))
        first = np.zeros(len(rays))
        levels = min(MOST_LEVELS, max(2, math.ceil(form.height_m / LEVEL_M)))
        for height_m in np.linspace(form.height_m, 0.0, levels, endpoint=False):
            depth = (height_m - self.plane.camera[2]) / rays[:, 2]
            xy = self.plane.camera[:2] + rays[:, :2] * depth[:, None] - middle
            meets = (first == 0.0) & form.contains(xy @ turn, float(height_m))
            first[meets] = depth[meets]
        drawn = np.zeros_like(at)
        drawn[at] = first > 0.0
        self.depth_m[drawn] = first[first > 0.0]
        # A ray may pass an edge between two levels: the table behind would count as the thing's.
        missed = (cv2.medianBlur(drawn.astype(np.uint8), 3) > 0) & ~drawn & self.looked_at
        near = cv2.dilate(np.where(drawn, self.depth_m, 0.0).astype(np.float32), _kernel(1))
        self.depth_m[missed] = near[missed]
        self.sights.append(KnownSight(class_name=form.thing.class_name, box_px=_box(drawn)))
        if form.is_hollow:
            self._hide_contents(drawn)

    def _hide_contents(self, container: Mask) -> None:
        """Say nothing of what has another colour in a container: its height there is not known."""
        off = (self._lab - np.median(self._lab[container], axis=0)) * SHADED
        other = container & (np.einsum("hwc,hwc->hw", off, off) > CONTENTS_LEVELS**2)
        speckless = cv2.medianBlur(other.astype(np.uint8), 3) > 0
        self.depth_m[_grown(speckless, 1)] = 0.0


def _pose_fault(plane: _PlaneView, near: Mask) -> str:
    ratio = float(near.mean())
    if plane.camera[2] >= LEAST_CAMERA_HEIGHT_M and ratio >= LEAST_VIEW_RATIO:
        return ""
    return (
        f"camera does not look at the table: {ratio:.2f} of the image shows the reach, least "
        f"{LEAST_VIEW_RATIO:g}, from {plane.camera[2]:.2f} m above it, least "
        f"{LEAST_CAMERA_HEIGHT_M:g} (correct the camera's site or its calibration)"
    )


def _blobs(foreign: Mask) -> Iterator[Mask]:
    speckless = cv2.medianBlur(foreign.astype(np.uint8), 3)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(speckless, connectivity=8)
    for number in range(1, count):
        if stats[number, cv2.CC_STAT_AREA] >= MIN_PIXELS:
            yield labels == number


def _sharpened(blob: Mask, contrast: Floats) -> Mask:
    """Return a blob without its fringe: lens and compression spread colours over the edge."""
    inner: Mask = blob & (contrast > EDGE_RATIO * float(np.median(contrast[blob])))
    return inner


def _parts_by_colour(blob: Mask, rgb: NDArray[np.uint8]) -> Iterator[Mask]:
    """Yield the parts of a blob that differ in colour: things that touch."""
    names = colour_names(rgb[blob])
    for name in np.flatnonzero(np.bincount(names) >= max(MIN_PIXELS, PART_SHARE * names.size)):
        part = np.zeros_like(blob)
        part[blob] = names == name
        # Where two meet, pixels have a colour between them.
        yield _grown(part, 1) & blob


def _grown(mask: Mask, by_px: int) -> Mask:
    grown: Mask = cv2.dilate(mask.astype(np.uint8), _kernel(by_px)) > 0
    return grown


def _kernel(by_px: int) -> NDArray[np.uint8]:
    return np.ones((2 * by_px + 1, 2 * by_px + 1), dtype=np.uint8)


def _box(mask: Mask) -> tuple[int, int, int, int]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
