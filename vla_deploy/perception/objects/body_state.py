"""Follow the robot's own body: its joints over time, its camera's pose, and what its hands hold."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.navigation.pose import Pose2D
from vla_deploy.perception.geometry.body_mask import BodyMask
from vla_deploy.perception.geometry.rotation import yaw_rotation
from vla_deploy.perception.objects.hands import Hands, Hold
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel

Array = NDArray[np.float64]
Point = tuple[float, float, float]
STALE_JOINTS_NS = NS_PER_S // 10
KEEP_NS = 2 * NS_PER_S


class JointHistory:
    """Interpolate joint positions between samples."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Array]] = deque()

    def add(self, stamp_ns: int, positions: Array) -> None:
        """Append a sample; one that is not newer than the last is ignored."""
        if self._samples and stamp_ns <= self._samples[-1][0]:
            return
        self._samples.append((stamp_ns, positions))
        while self._samples[0][0] < stamp_ns - KEEP_NS:
            self._samples.popleft()

    def at(self, stamp_ns: int, max_gap_ns: int) -> Array | None:
        """Return the positions at a moment, None where no sample is near.

        They are interpolated between two samples that lie no further apart than the gap; before the
        first and after the last they are held for as long.
        """
        if not self._samples:
            return None
        stamps = np.array([stamp for stamp, _ in self._samples], dtype=np.int64)
        after = int(np.searchsorted(stamps, stamp_ns))
        if after == 0 or after == len(stamps):
            nearest = min(after, len(stamps) - 1)
            near = abs(int(stamps[nearest]) - stamp_ns) <= max_gap_ns
            return self._samples[nearest][1] if near else None
        (first_ns, first), (second_ns, second) = self._samples[after - 1], self._samples[after]
        if stamp_ns == second_ns:
            return second
        if second_ns - first_ns > max_gap_ns:
            return None
        share = (stamp_ns - first_ns) / (second_ns - first_ns)
        blended: Array = first + share * (second - first)
        return blended


@dataclass(frozen=True, slots=True, kw_only=True)
class HandState:
    """Hold what a hand holds, and where its grip is in the base frame."""

    name: str
    hold: Hold
    grip: Point


class BodyState:
    """Hold the joints' positions over time, from control's joint states."""

    def __init__(self, robot: RobotDescription, model: RobotModel) -> None:
        """Read the body's shapes.

        Raises:
            RobotFileError: the MJCF does not fit the robot file.
        """
        self._robot = robot
        self._model = model
        self._mask = BodyMask(robot)
        self._joints = JointHistory()
        self._hands = Hands(robot)

    def start(self, space: SharedSpace) -> None:
        """Open the topics."""
        self._joint_state = space.cell_reader(topics.JOINT_STATE)
        self._executor_status = space.cell_reader(topics.EXECUTOR_STATUS)

    def read(self) -> None:
        """Take the newest joint state."""
        sample = self._joint_state.latest()
        if sample is not None:
            count = len(self._robot.joint_names)
            positions = np.array(sample.data["position"][:count], dtype=np.float64)
            self._joints.add(sample.stamp_ns, positions)
            self._hands.update(sample)

    def at(self, stamp_ns: int) -> Array | None:
        """Return the joints' positions at a moment; None where nothing near it is known."""
        return self._joints.at(stamp_ns, STALE_JOINTS_NS)

    def camera_pose(self, positions: Array) -> Array:
        """Return the camera's optical frame in the base frame, 4 x 4."""
        pose: Array = self._model.camera_pose(positions)
        return pose

    def mask(self, positions: Array, camera: Intrinsics) -> NDArray[np.bool_]:
        """Return an image that is true where the robot itself is seen."""
        return self._mask.mask(positions, camera)

    def hands(self, positions: Array, now_ns: int) -> list[HandState]:
        """Return the hands with what they hold, by the executor's report and by touch."""
        sample = self._executor_status.latest()
        reported = {} if sample is None else sample.document().get("holding", {})
        holds = self._hands.holds(reported, now_ns)
        return [
            HandState(name=name, hold=holds[name], grip=self._grip(hand.grip_site, positions))
            for name, hand in self._robot.hands.items()
        ]

    def view_rotation(self, stamp_ns: int, base: Pose2D) -> Array:
        """Return the camera's rotation in the frame of `base`, 3 x 3; unit where unknown."""
        positions = self.at(stamp_ns)
        if positions is None:
            return np.eye(3)
        rotation: Array = yaw_rotation(base.yaw_rad) @ self._model.camera_pose(positions)[:3, :3]
        return rotation

    def _grip(self, site: str, positions: Array) -> Point:
        x, y, z = (float(value) for value in self._model.site_pose(site, positions)[:3, 3])
        return (x, y, z)
