"""Place the beams of a scan in the dead-reckoned frame, each by the pose of its moment."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.navigation.localising.scan_match import ScanPoints
from vla_deploy.robots.floor_pose import Pose2D

MAX_BEAM_M: Final = 8.0
MIN_BEAM_M: Final = 0.25


def placed_beams(
    track: DeadReckoning,
    lidar: Pose2D,
    range_m: NDArray[np.float32],
    beam_stamp_ns: NDArray[np.int64],
) -> ScanPoints:
    """Return the beams that met something near enough; `lidar` is its place on the base.

    What is no number, no return, or beyond the sensor's good range is left out.
    """
    beams = np.flatnonzero((range_m > MIN_BEAM_M) & (range_m < MAX_BEAM_M))
    angles = np.radians(beams * (360.0 / len(range_m))) + lidar.yaw_rad
    ranges = range_m[beams].astype(np.float64)
    x = lidar.x_m + ranges * np.cos(angles)
    y = lidar.y_m + ranges * np.sin(angles)
    at = np.tile((lidar.x_m, lidar.y_m), (len(beams), 1))
    moments = beam_stamp_ns[beams]
    return ScanPoints(track.place(at, moments), track.place(np.column_stack((x, y)), moments))
