"""Judge whether an image can be what the camera sees now, by one table of limits.

A fault takes away only what it spoils. A grainy image is not given to the detector; without colours
nothing is named, but depth still shows obstacles; without depth, or where an image is not of the
present, nothing is published. What is not published becomes stale, and its readers act on that by
their own rules.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from vla_deploy.perception.images.frame_statistics import FrameStatistics

# An emulated camera has no noise in its colours: at up to a third of the rows that have contrast
# the robot's own arms stay the same before a plain wall.
STALE_COLOUR_RATIO: Final = 0.6


class ImageUse(IntEnum):
    """Say what an image is good for; each use includes those below it."""

    NOTHING = 0
    OBSTACLES = 1
    FORM = 2
    ALL = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class StatisticLimit:
    """Bound one statistic of an image: beyond `most`, it is good for `leaves` and no more."""

    fault: str
    measure: Callable[[FrameStatistics], float]
    most: float
    leaves: ImageUse
    meaning: str


LIMITS: Final[tuple[StatisticLimit, ...]] = (
    StatisticLimit(
        fault="no new image",
        measure=lambda seen: seen.silent_s,
        most=1.5,
        leaves=ImageUse.NOTHING,
        meaning="s since the last one",
    ),
    StatisticLimit(
        fault="frozen",
        measure=lambda seen: seen.stale_ratio,
        most=0.95,
        leaves=ImageUse.NOTHING,
        meaning="share of rows whose depth is to the bit that of the image before",
    ),
    StatisticLimit(
        fault="torn",
        measure=lambda seen: seen.stale_ratio if seen.stale_ratio <= 0.95 else 0.0,
        most=0.05,
        leaves=ImageUse.NOTHING,
        meaning="share of rows whose depth is to the bit that of the image before",
    ),
    StatisticLimit(
        fault="stale colours",
        measure=lambda seen: seen.stale_colour_ratio,
        most=STALE_COLOUR_RATIO,
        leaves=ImageUse.OBSTACLES,
        meaning="share of rows of colour that are to the bit those before, while the camera moved",
    ),
    StatisticLimit(
        fault="frozen while the camera moved",
        measure=lambda seen: seen.unmoved_rad,
        most=0.12,
        leaves=ImageUse.NOTHING,
        meaning="change of view in rad, after which it shows the same",
    ),
    StatisticLimit(
        fault="cut off",
        measure=lambda seen: seen.missing_ratio,
        most=0.05,
        leaves=ImageUse.NOTHING,
        meaning="share of rows that are empty in colour and depth, while others are not",
    ),
    StatisticLimit(
        fault="depth holes",
        measure=lambda seen: seen.hole_ratio,
        most=0.92,
        leaves=ImageUse.NOTHING,
        meaning="share of pixels without depth",
    ),
    StatisticLimit(
        fault="noisy depth",
        measure=lambda seen: seen.depth_noise_ratio,
        most=4.0,
        leaves=ImageUse.NOTHING,
        meaning="noise of depth over what a stereo camera has at this distance",
    ),
    StatisticLimit(
        fault="dark",
        measure=lambda seen: seen.dark_ratio,
        most=0.9,
        leaves=ImageUse.OBSTACLES,
        meaning="share of pixels too dark to have a colour",
    ),
    StatisticLimit(
        fault="saturated",
        measure=lambda seen: seen.saturated_ratio,
        most=0.6,
        leaves=ImageUse.OBSTACLES,
        meaning="share of pixels that are white beyond measure",
    ),
    StatisticLimit(
        # A real wall has more noise and shade than this. Where the twin's walls are not near, a
        # quarter of the pixels or more have another colour.
        fault="plain",
        measure=lambda seen: seen.plain_ratio,
        most=0.98,
        leaves=ImageUse.OBSTACLES,
        meaning="share of pixels of one and the same colour",
    ),
    StatisticLimit(
        fault="noisy",
        measure=lambda seen: seen.colour_noise_levels,
        most=25.0,
        leaves=ImageUse.OBSTACLES,
        meaning="noise in levels of 255",
    ),
    StatisticLimit(
        fault="grainy",
        measure=lambda seen: seen.colour_noise_levels,
        most=15.0,
        leaves=ImageUse.FORM,
        meaning="noise in levels of 255",
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageVerdict:
    """Hold what an image is good for, and why it is not for more."""

    use: ImageUse
    faults: tuple[str, ...]


def judge_frame(seen: FrameStatistics) -> ImageVerdict:
    """Return what an image with these statistics is good for, with each fault that limits it."""
    beyond = [limit for limit in LIMITS if limit.measure(seen) > limit.most]
    worst = min((limit.leaves for limit in beyond), default=ImageUse.ALL)
    return ImageVerdict(
        use=worst,
        faults=tuple(
            f"{limit.fault}: {limit.measure(seen):.3g}, limit {limit.most:g} ({limit.meaning})"
            for limit in beyond
            if limit.leaves == worst
        ),
    )
