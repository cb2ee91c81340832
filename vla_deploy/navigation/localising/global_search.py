"""Search the whole map for the places that a scan fits, without any idea where the robot is.

For each heading the turned scan is correlated with the map's walls by FFT, which tries every
place of a coarse grid at once; the best of them are then fitted on the fine field. The headings
are tried a few at a time, so that a search does not hold up its process.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.scan_match import Match, ScanPoints, fit
from vla_deploy.navigation.maps.distance_field import DistanceField
from vla_deploy.robots.floor_pose import ORIGIN, Points, Pose2D

Floats = NDArray[np.float32]

CELL_M: Final = 0.1
HEADINGS: Final = 120
WALL_SIGMA_M: Final = 0.15
REACH_M: Final = 6.0
CLEAR_M: Final = 0.12
PEAKS_PER_HEADING: Final = 6
CANDIDATES: Final = 16
APART_M: Final = 0.35
APART_RAD: Final = 0.3


@dataclass(frozen=True, slots=True)
class _Peak:
    score: float
    pose: Pose2D


class WallImage:
    """Hold the map's walls as a blurred image with its spectrum, made once per map."""

    def __init__(self, field: DistanceField) -> None:
        height_m, width_m = (n * field.resolution_m for n in field.cells_m.shape)
        self.rows, self.columns = math.ceil(height_m / CELL_M), math.ceil(width_m / CELL_M)
        self.margin = math.ceil(REACH_M / CELL_M)
        self.origin_m = field.origin_m
        columns, rows = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        centres = (np.column_stack((columns.ravel(), rows.ravel())) + 0.5) * CELL_M
        at = centres + self.origin_m
        distance_m = field.sample(at)[0].reshape(self.rows, self.columns)
        near = np.exp(-0.5 * (distance_m / WALL_SIGMA_M) ** 2).astype(np.float32)
        self.free = distance_m > CLEAR_M
        self.shape = (_smooth(self.rows + 2 * self.margin), _smooth(self.columns + 2 * self.margin))
        self.spectrum = np.fft.rfft2(near, s=self.shape)

    def correlate(self, points: Points) -> Floats:
        """Return, for a scan's middle in each cell, the share of `points` near walls."""
        cells = np.rint(points / CELL_M).astype(np.intp)
        image = np.zeros(self.shape, dtype=np.float32)
        # Negative offsets wrap around: the margin keeps them off the map's own cells.
        np.add.at(image, (cells[:, 1], cells[:, 0]), np.float32(1.0 / len(points)))
        product = self.spectrum * np.conj(np.fft.rfft2(image))
        score = np.fft.irfft2(product, s=self.shape)[: self.rows, : self.columns]
        return np.where(self.free, score, 0.0).astype(np.float32)


class GlobalSearch:
    """Search for the places that one scan fits; `local` is given in the base's frame."""

    def __init__(self, field: DistanceField, image: WallImage, local: ScanPoints) -> None:
        self._field = field
        self._image = image
        self._local = local
        near = np.hypot(local.ends[:, 0], local.ends[:, 1]) < REACH_M
        self._points = local.ends[near]
        self._heading = 0
        self._peaks: list[_Peak] = []
        self._unfitted: list[_Peak] | None = None
        self._fitted: list[Match] = []

    @property
    def finished(self) -> bool:
        """Return whether every heading has been tried, and every good place been fitted."""
        return self._unfitted == []

    @property
    def matches(self) -> list[Match]:
        """Return the distinct places found so far, the best first."""
        found: list[Match] = []
        for match in sorted(self._fitted, key=lambda one: -one.score):
            if not any(_is_same(match.pose, other.pose) for other in found):
                found.append(match)
        return found

    def advance(self, headings: int) -> None:
        """Try a few more headings; then fit as many places a time."""
        if self._unfitted is None:
            for _ in range(min(headings, HEADINGS - self._heading)):
                yaw_rad = math.tau * self._heading / HEADINGS
                self._heading += 1
                self._peaks += self._best_of(yaw_rad)
            if self._heading == HEADINGS:
                self._unfitted = _apart(self._peaks)
            return
        now, self._unfitted = self._unfitted[:headings], self._unfitted[headings:]
        self._fitted += [self._fit(peak.pose) for peak in now]

    def _best_of(self, yaw_rad: float) -> list[_Peak]:
        if not len(self._points):
            return []
        score = self._image.correlate(Pose2D(0.0, 0.0, yaw_rad).place(self._points))
        flat = score.ravel()
        best = np.argpartition(flat, -PEAKS_PER_HEADING)[-PEAKS_PER_HEADING:]
        rows, columns = np.unravel_index(best, score.shape)
        x_m = (columns + 0.5) * CELL_M + self._image.origin_m[0]
        y_m = (rows + 0.5) * CELL_M + self._image.origin_m[1]
        return [
            _Peak(float(flat[at]), Pose2D(float(x), float(y), yaw_rad))
            for at, x, y in zip(best, x_m, y_m, strict=True)
        ]

    def _fit(self, pose: Pose2D) -> Match:
        """Fit twice: the coarse place may be off by more than the basin of a single fit."""
        first = fit(self._field, self._local.placed(pose), pose)
        return fit(self._field, self._local.placed(first.pose), first.pose)


def _apart(peaks: list[_Peak]) -> list[_Peak]:
    """Return the peaks that are no better one's neighbours, the best first."""
    kept: list[_Peak] = []
    for peak in sorted(peaks, key=lambda one: -one.score):
        if len(kept) == CANDIDATES:
            break
        if not any(_is_same(peak.pose, other.pose) for other in kept):
            kept.append(peak)
    return kept


def _is_same(one: Pose2D, other: Pose2D) -> bool:
    return one.distance_m(other) < APART_M and one.turn_rad(other) < APART_RAD


def local_points(scan: ScanPoints, base: Pose2D) -> ScanPoints:
    """Return a scan in the frame of a base whose pose is given in the scan's frame."""
    return scan.placed(ORIGIN.relative_to(base))


def _smooth(size: int) -> int:
    """Return the next size that an FFT is fast at."""
    while True:
        rest = size
        for factor in (2, 3, 5):
            while rest % factor == 0:
                rest //= factor
        if rest == 1:
            return size
        size += 1
