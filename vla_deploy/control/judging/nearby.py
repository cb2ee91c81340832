"""Bring obstacle points of lidar and depth camera to where they are now, without the own body."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.control.motion.axes import Floats
from vla_deploy.ipc import BY_NAME, CellReader, SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.protection import ZoneSource
from vla_deploy.safety.zones import BaseMotion, Points, moved

# A lidar's ranges are off by a centimetre or two, and joints move while it turns.
MASK_MARGIN_M = 0.03
TOPICS: Mapping[ZoneSource, str] = {
    ZoneSource.LIDAR: "scan",
    ZoneSource.DEPTH: "near_obstacles",
}
# Of the period at which the depth camera's images are looked at: what may be missing in between.
PERIODS_MISSED = 3.0
_NO_POINTS: Points = np.zeros((0, 2))


class Nearby:
    """Read one source of obstacle points."""

    def __init__(
        self,
        source: ZoneSource,
        space: SharedSpace,
        robot: RobotDescription,
        model: RobotModel,
        body: BodyShapes,
    ) -> None:
        topic = TOPICS[source]
        self._source = source
        self._reader: CellReader = space.cell_reader(topic)
        self._deadline_s = BY_NAME[topic].deadline_s
        self._body = body
        lidar = robot.parts.lidar
        self._lidar = (
            np.zeros(3)
            if lidar is None
            else model.site_pose(lidar.site, full_positions(robot))[:3, 3]
        )
        self._sequence = 0
        self._points = _NO_POINTS
        self.age_s: float | None = None
        self.due_s = 0.0
        self.fresh = False

    def points(self, now_ns: int, position: Floats, motion: BaseMotion) -> Points:
        """Return the newest points as seen from where the base is now; none once they are stale.

        `fresh` tells whether they came since the last call, `due_s` the age beyond which the next
        ones are overdue at the rate that their source has told.
        """
        sample = self._reader.latest()
        self.fresh = False
        if sample is None:
            return _NO_POINTS
        self.age_s = (now_ns - sample.stamp_ns) / NS_PER_S
        if sample.sequence != self._sequence:
            self._sequence, self.fresh = sample.sequence, True
            read = self._read_scan if self._source is ZoneSource.LIDAR else self._read_depth
            self._points = read(sample.data, position)
        if self.age_s > max(self._deadline_s, self.due_s):
            self.fresh = True  # knowing nothing is news too: it releases what old points hold
            return _NO_POINTS
        return moved(self._points, motion.v_m_s * self.age_s, motion.w_rad_s * self.age_s)

    def close(self) -> None:
        """Unmap the topic."""
        self._reader.close()

    def _read_scan(self, data: np.void, position: Floats) -> Points:
        ranges_m = np.asarray(data["range_m"], dtype=np.float64)
        beams = np.flatnonzero(ranges_m > 0.0)
        angles = np.deg2rad(beams * (360.0 / len(ranges_m)))
        points: Points = ranges_m[beams, None] * np.column_stack((np.cos(angles), np.sin(angles)))
        points += self._lidar[:2]
        return points[~self._shows_body(points, position)]

    def _read_depth(self, data: np.void, position: Floats) -> Points:
        """Take points that perception has cleared of the robot's own body in the image."""
        self.due_s = PERIODS_MISSED * float(data["period_s"])
        count = int(data["count"])
        columns = [np.asarray(data[name], dtype=np.float64)[:count] for name in ("x_m", "y_m")]
        return np.column_stack(columns)

    def _shows_body(self, points: Points, position: Floats) -> NDArray[np.bool_]:
        """Return which lidar points lie on arms that reach into the plane of the beams."""
        centres, radii_m = self._body.balls(position)
        height_m = np.abs(centres[:, 2] - self._lidar[2])
        cut = height_m < radii_m + MASK_MARGIN_M
        if not cut.any():
            return np.zeros(len(points), dtype=np.bool_)
        offset = points[:, None, :] - centres[cut, :2]
        inside = (offset**2).sum(axis=2) < (radii_m[cut] + MASK_MARGIN_M) ** 2
        return np.asarray(inside.any(axis=1))
