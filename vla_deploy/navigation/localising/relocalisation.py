"""Find the robot on the map again: search, then let scans decide among the places found.

For each heading the turned scan is correlated with the map's walls by FFT, which tries every place
of a coarse grid at once; the best of them are then fitted on the fine field. The headings are tried
a few at a time, so that a search does not hold up its process.

One scan may fit several places. They are carried along by dead reckoning and judged by every
further scan, until one alone is left or none fits any more; then the search begins anew.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Final, Protocol, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.scan import ScanPoints
from vla_deploy.navigation.localising.scan_match import Match, fit
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
HEADINGS_PER_STEP: Final = 4
# A place is believed only where the scan fits as well as this, and clearly better than elsewhere.
FOUND_SCORE: Final = 0.75
LEFT_SCORE: Final = 0.5
MARGIN: Final = 0.15
CONFIRMING_SCANS: Final = 3
MOST_PLACES: Final = 6
DOUBLE_M: Final = 0.1
DOUBLE_RAD: Final = 0.1


class _Found(Protocol):
    @property
    def score(self) -> float: ...
    @property
    def pose(self) -> Pose2D: ...


FoundT = TypeVar("FoundT", bound=_Found)


@dataclass(frozen=True, slots=True)
class _Peak:
    score: float
    pose: Pose2D


@dataclass(slots=True)
class _Place:
    """Hold where the dead-reckoned frame would lie on the map, and how scans fit there."""

    map_from_track: Pose2D
    score: float
    match: Match

    @property
    def pose(self) -> Pose2D:
        return self.match.pose


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
        around = (self.rows + 2 * self.margin, self.columns + 2 * self.margin)
        self.shape = tuple(cv2.getOptimalDFTSize(size) for size in around)
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
        return list(_distinct(self._fitted, APART_M, APART_RAD))

    def advance(self, headings: int) -> None:
        """Try a few more headings; then fit as many places a time."""
        if self._unfitted is None:
            for _ in range(min(headings, HEADINGS - self._heading)):
                yaw_rad = math.tau * self._heading / HEADINGS
                self._heading += 1
                self._peaks += self._best_of(yaw_rad)
            if self._heading == HEADINGS:
                best = _distinct(self._peaks, APART_M, APART_RAD)
                self._unfitted = list(islice(best, CANDIDATES))
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


class Relocaliser:
    """Look for the robot while it is lost."""

    def __init__(self, field: DistanceField) -> None:
        self._field = field
        self._image: WallImage | None = None
        self._search: GlobalSearch | None = None
        self._search_base = ORIGIN
        self._places: list[_Place] = []
        self._scans = 0

    @property
    def places(self) -> int:
        """Return how many places still fit; 0 while the search goes on."""
        return len(self._places)

    def reset(self) -> None:
        """Forget everything but the map."""
        self._search, self._places, self._scans = None, [], 0

    def work(self) -> None:
        """Go on with a search, a few milliseconds' worth."""
        if self._search is None:
            return
        if not self._search.finished:
            self._search.advance(HEADINGS_PER_STEP)
            return
        fitting = [one for one in self._search.matches if one.score >= LEFT_SCORE]
        track_origin = ORIGIN.relative_to(self._search_base)
        self._places = [
            _Place(one.pose.compose(track_origin), one.score, one) for one in fitting[:MOST_PLACES]
        ]
        self._search, self._scans = None, 0

    def take(self, scan: ScanPoints, base: Pose2D) -> Match | None:
        """Take a scan and the base's pose, both in the track; return the place once it is sure."""
        if self._search is not None:
            return None
        if not self._places:
            self._begin(scan, base)
            return None
        for place in self._places:
            self._judge(place, scan, base)
        self._drop()
        self._scans += 1
        best = self._places[0] if self._places else None
        if best is None or self._scans < CONFIRMING_SCANS or len(self._places) > 1:
            return None
        if best.score < FOUND_SCORE:
            self.reset()
            return None
        return best.match

    def _begin(self, scan: ScanPoints, base: Pose2D) -> None:
        if self._image is None:
            self._image = WallImage(self._field)
        local = scan.placed(ORIGIN.relative_to(base))
        self._search, self._search_base = GlobalSearch(self._field, self._image, local), base

    def _judge(self, place: _Place, scan: ScanPoints, base: Pose2D) -> None:
        frame = place.map_from_track
        match = fit(self._field, scan.placed(frame), frame.compose(base))
        place.match = match
        place.score = 0.7 * place.score + 0.3 * match.score
        place.map_from_track = match.pose.compose(ORIGIN.relative_to(base))

    def _drop(self) -> None:
        """Drop the places that fit badly, or clearly worse than the best; and doubles."""
        least = max(LEFT_SCORE, max(place.score for place in self._places) - MARGIN)
        left = [place for place in self._places if place.score >= least]
        self._places = list(_distinct(left, DOUBLE_M, DOUBLE_RAD))


def _distinct(found: Iterable[FoundT], apart_m: float, apart_rad: float) -> Iterator[FoundT]:
    """Yield what is no better one's neighbour, the best first."""
    kept: list[FoundT] = []
    for one in sorted(found, key=lambda one: -one.score):
        if not any(
            one.pose.distance_m(other.pose) < apart_m and one.pose.turn_rad(other.pose) < apart_rad
            for other in kept
        ):
            kept.append(one)
            yield one
