"""Say how well the robot knows where it is; the numbers are those of topic `pose`."""

from enum import IntEnum
from typing import Final


class PlaceState(IntEnum):
    """Say what the pose is worth."""

    TRACKING = 0
    UNSURE = 1
    LOST = 2


class Doubt(IntEnum):
    """Say why the pose is in doubt."""

    NONE = 0
    STARTING = 1
    NO_SCAN = 2
    POOR_MATCH = 3
    THROUGH_WALLS = 4
    INCONSISTENT = 5
    UNCERTAIN = 6
    AMBIGUOUS = 7
    FOUND_AGAIN = 8


DOUBT_TEXT: Final = {
    Doubt.NONE: "",
    Doubt.STARTING: "it has just started",
    Doubt.NO_SCAN: "the lidar tells nothing of use",
    Doubt.POOR_MATCH: "what the lidar sees does not fit the map",
    Doubt.THROUGH_WALLS: "the lidar sees through walls of the map",
    Doubt.INCONSISTENT: "scans contradict wheels and IMU",
    Doubt.UNCERTAIN: "it has gone too far without a scan that fits",
    Doubt.AMBIGUOUS: "several places of the map look like this one",
    Doubt.FOUND_AGAIN: "it was lost and has just found a place that fits",
}
