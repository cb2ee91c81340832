"""Hold a scan's beams as points, each placed by where the base was at its moment."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.navigation.localising.dead_reckoning import DeadReckoning
from vla_deploy.robots.floor_pose import Points, Pose2D

Floats = NDArray[np.float64]

MAX_BEAM_M: Final = 8.0
MIN_BEAM_M: Final = 0.25
# Neighbouring beams that end this near to each other show one surface.
NEIGHBOUR_M: Final = 0.35


@dataclass(frozen=True, slots=True, eq=False)
class ScanPoints:
    """Hold where each beam of a scan started and what it met, (n, 2) each, in one frame."""

    starts: Points
    ends: Points

    def __len__(self) -> int:
        return len(self.ends)

    def placed(self, frame: Pose2D) -> "ScanPoints":
        """Return them in the frame that `frame` is given in."""
        return ScanPoints(frame.place(self.starts), frame.place(self.ends))

    def beams(self) -> tuple[Points, Floats]:
        """Return each beam's direction, (n, 2) of length 1, and its length in metres."""
        ways = self.ends - self.starts
        length_m = np.hypot(ways[:, 0], ways[:, 1])
        return ways / np.maximum(length_m, 1e-9)[:, None], length_m

    def surface_normals(self) -> Points:
        """Return, for each point, the direction into the surface; the beam's if it stands alone.

        The points must be in the order of the beams.
        """
        beams, _ = self.beams()
        following = np.roll(self.ends, -1, axis=0)
        along = following - np.roll(self.ends, 1, axis=0)
        length_m = np.hypot(along[:, 0], along[:, 1])
        steps = np.hypot(*(following - self.ends).T)
        joined = (steps < NEIGHBOUR_M) & (np.roll(steps, 1) < NEIGHBOUR_M) & (length_m > 1e-6)
        normal = np.column_stack((-along[:, 1], along[:, 0])) / np.maximum(length_m, 1e-9)[:, None]
        normal *= np.sign((normal * beams).sum(axis=1))[:, None]
        return np.where(joined[:, None], normal, beams)


def placed_beams(
    track: DeadReckoning,
    lidar: Pose2D,
    range_m: NDArray[np.float32],
    beam_stamp_ns: NDArray[np.int64],
) -> ScanPoints:
    """Return, in the dead-reckoned frame, the beams that met something near enough.

    `lidar` is its place on the base. What is no number, no return, or beyond the sensor's good
    range is left out.
    """
    beams = np.flatnonzero((range_m > MIN_BEAM_M) & (range_m < MAX_BEAM_M))
    angles = np.radians(beams * (360.0 / len(range_m))) + lidar.yaw_rad
    ranges = range_m[beams].astype(np.float64)
    x = lidar.x_m + ranges * np.cos(angles)
    y = lidar.y_m + ranges * np.sin(angles)
    at = np.tile((lidar.x_m, lidar.y_m), (len(beams), 1))
    moments = beam_stamp_ns[beams]
    return ScanPoints(track.place(at, moments), track.place(np.column_stack((x, y)), moments))
