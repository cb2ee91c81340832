"""Measure what distinguishes a sound image from a spoiled one, alone and against earlier ones."""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from vla_deploy.perception.geometry.cloud import DEPTH_SIGMA_PER_M, Floats, Mask

Image = NDArray[np.uint8]
Depth = NDArray[np.uint16]

DARK_LEVEL: Final = 30
WHITE_LEVEL: Final = 252
EMPTY_LEVEL: Final = 2
ONE_COLOUR_LEVELS: Final = 1
NEAR_WALL_M: Final = 1.0
"""A nearer wall may fill the view, and without noise it may have one colour only."""
THUMB_PX: Final = (40, 30)
PLAIN_LEVELS: Final = 6.0
"""Contrast below which a move of the camera changes nothing, such as before a bare wall."""
SAME_LEVELS: Final = 0.7
ROW_STRIDE: Final = 4
SATURATED_DEPTH: Final = np.iinfo(np.uint16).max
LEAST_SHARE: Final = 0.25
"""Share of a row that must be noisy for the row to count, and of the rows that must count.

Fewer pixels may all be the same by chance.
"""
LEAST_SIGMA_M: Final = 0.0005
_SECOND_DIFFERENCE: Final = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
_ITS_MEAN_OF_NOISE: Final = 6.0 * math.sqrt(2.0 / math.pi)
"""Its mean absolute value for noise of deviation 1 (Immerkaer 1996)."""
_MEDIAN_OF_NOISE: Final = 0.6745 * math.sqrt(6.0)
"""The median absolute second difference along a row, likewise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameStatistics:
    """Hold the measures of one image.

    Ratios are shares of pixels or rows, from 0 to 1. `unmoved_rad` is by how much the camera has
    turned since images began to show the same; 0 where they do not, or show too little to decide.
    `stale_colour_ratio` is 0 as long as the camera has not moved meanwhile. `silent_s` is the time
    since the last image.
    """

    dark_ratio: float = 0.0
    saturated_ratio: float = 0.0
    plain_ratio: float = 0.0
    colour_noise_levels: float = 0.0
    missing_ratio: float = 0.0
    hole_ratio: float = 0.0
    depth_noise_ratio: float = 0.0
    stale_ratio: float = 0.0
    stale_colour_ratio: float = 0.0
    unmoved_rad: float = 0.0
    silent_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameSignature:
    """Hold what is kept of an image to compare later ones with.

    `depth_rows` are true for rows of depth that cannot be the same twice, `colour_rows` for rows of
    colour that cannot when the camera moves.
    """

    rgb: Image
    depth: Depth
    thumb: Floats
    depth_rows: Mask
    colour_rows: Mask

    @classmethod
    def of(cls, frame: RgbdFrame) -> "FrameSignature":
        """Return what is kept of an image."""
        grey = cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2GRAY)
        small = cv2.resize(grey, THUMB_PX, interpolation=cv2.INTER_AREA)
        return cls(
            rgb=frame.rgb,
            depth=frame.depth,
            thumb=small.astype(np.float32),
            depth_rows=_noisy_rows(frame),
            colour_rows=grey[:, ::ROW_STRIDE].std(axis=1) >= PLAIN_LEVELS,
        )

    def shows_the_same(self, other: "FrameSignature") -> bool:
        """Return whether two images show the same view of something that has contrast."""
        plain = min(float(self.thumb.std()), float(other.thumb.std())) < PLAIN_LEVELS
        change = float(np.abs(self.thumb - other.thumb).mean())
        return not plain and change < SAME_LEVELS

    def stale_ratio(self, depth: Depth) -> float:
        """Return the share of rows with noisy depth in which not one bit of depth differs.

        No sensor's depth repeats like that. Colours may, in a row that is black or white, and they
        may be live while the depth has stopped.
        """
        if self.depth.shape != depth.shape:
            return 0.0
        return _share_of((self.depth == depth).all(axis=1), self.depth_rows)

    def stale_colour_ratio(self, other: "FrameSignature") -> float:
        """Return the share of rows with contrast in which not one bit of colour differs."""
        if self.rgb.shape != other.rgb.shape:
            return 0.0
        return _share_of((self.rgb == other.rgb).all(axis=(1, 2)), self.colour_rows)


def measure_frame(rgb: Image, depth_m: Floats) -> FrameStatistics:
    """Measure an image by itself; `depth_m` is 0 where there is no depth."""
    return FrameStatistics(
        dark_ratio=_share_between(rgb, 0, DARK_LEVEL),
        saturated_ratio=_share_between(rgb, WHITE_LEVEL, 255),
        plain_ratio=_plain_share(rgb, depth_m),
        colour_noise_levels=_colour_noise(rgb),
        missing_ratio=_missing_rows(rgb, depth_m),
        hole_ratio=1.0 - int(np.count_nonzero(depth_m)) / depth_m.size,
        depth_noise_ratio=_depth_noise(depth_m[::ROW_STRIDE]),
    )


def _noisy_rows(frame: RgbdFrame) -> Mask:
    """Return which rows have depth that a stereo camera could not measure twice alike.

    Of nearer pixels the noise is lost in the rounding: along a near wall depth may stay the same.
    """
    noisy_from_m = math.sqrt(0.5 * frame.depth_unit_m / DEPTH_SIGMA_PER_M)
    far = (frame.depth >= noisy_from_m / frame.depth_unit_m) & (frame.depth < SATURATED_DEPTH)
    rows: Mask = np.count_nonzero(far, axis=1) >= LEAST_SHARE * far.shape[1]
    return rows


def _share_of(same: Mask, counted: Mask) -> float:
    """Return the share of the counted rows that are the same; 0 where those are too few."""
    count = int(np.count_nonzero(counted))
    if count < LEAST_SHARE * len(counted):
        return 0.0
    return int(np.count_nonzero(same & counted)) / count


def _share_between(rgb: Image, low: int, high: int) -> float:
    """Return the share of pixels of which every channel is within bounds."""
    within = cv2.inRange(rgb, (low,) * 3, (high,) * 3)
    return cv2.countNonZero(within) / int(within.size)


def _plain_share(rgb: Image, depth_m: Floats) -> float:
    """Return the share of pixels that have the colour of the middle one.

    It is 0 where a near wall may fill half of the view, and where all is dark or white.
    """
    if int(np.count_nonzero(depth_m >= NEAR_WALL_M)) < 0.5 * depth_m.size:
        return 0.0
    colour = np.median(rgb[::ROW_STRIDE, ::ROW_STRIDE].reshape(-1, 3), axis=0)
    if colour.max() <= DARK_LEVEL or colour.min() >= WHITE_LEVEL:
        return 0.0
    within = cv2.inRange(rgb, colour - ONE_COLOUR_LEVELS, colour + ONE_COLOUR_LEVELS)
    return cv2.countNonZero(within) / int(within.size)


def _colour_noise(rgb: Image) -> float:
    """Return the deviation of noise in the middle one of small tiles.

    Edges and patterns fill some tiles; noise fills all of them.
    """
    rough = np.abs(cv2.filter2D(cv2.extractChannel(rgb, 1), cv2.CV_32F, _SECOND_DIFFERENCE))
    tiles = cv2.resize(rough, THUMB_PX, interpolation=cv2.INTER_AREA)
    return float(np.median(tiles)) / _ITS_MEAN_OF_NOISE


def _missing_rows(rgb: Image, depth_m: Floats) -> float:
    """Return the share of rows that are empty in colour and depth, unless all are."""
    without_depth = ~depth_m.any(axis=1)
    missing = int(np.count_nonzero(rgb[without_depth].max(axis=(1, 2), initial=0) <= EMPTY_LEVEL))
    return 0.0 if missing == len(rgb) else missing / len(rgb)


def _depth_noise(rows_m: Floats) -> float:
    """Return how strong the noise along rows is, over what is usual; edges are the rarer half."""
    left, middle, right = rows_m[:, :-2], rows_m[:, 1:-1], rows_m[:, 2:]
    known = (left > 0.0) & (middle > 0.0) & (right > 0.0)
    if not known.any():
        return 0.0
    usual = np.maximum(np.float32(DEPTH_SIGMA_PER_M) * middle[known] ** 2, LEAST_SIGMA_M)
    bend = np.abs(left[known] - 2.0 * middle[known] + right[known])
    return float(np.median(bend / usual)) / _MEDIAN_OF_NOISE
