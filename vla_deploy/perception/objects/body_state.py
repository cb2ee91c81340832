"""Follow the robot's own body: its joints over time, its camera's pose, and what its hands hold.

The executor reports what a hand holds, the fingers confirm or deny it.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from drivers.clock import NS_PER_S
from vla_deploy.ipc import Sample, SharedSpace, topics
from vla_deploy.ipc.payloads.scene import HandDocument
from vla_deploy.perception.geometry.body_mask import BodyMask
from vla_deploy.perception.naming.classes import OTHER
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.kinematics.orientation import yaw_rotation
from vla_deploy.world.touch import FingerSample, Grip, Touch, feel

Array = NDArray[np.float64]
Point = tuple[float, float, float]
STALE_JOINTS_NS = NS_PER_S // 10
KEEP_NS = 2 * NS_PER_S
# Older samples of the fingers are not used.
STALE_FINGERS_NS = NS_PER_S // 4


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
class Hold:
    """Hold what a hand holds: `kind` is a class, "" for nothing; `cause` why it no longer does.

    `reported` is the class that the executor names.
    """

    kind: str
    reported: str
    touch: Touch
    is_confirmed: bool
    cause: str = ""

    @property
    def is_lost(self) -> bool:
        """Return whether the hand lost what it was to hold, rather than putting it down."""
        return not self.kind and self.touch.grip is Grip.LOST

    def document(self, holding: str | None) -> HandDocument:
        """Return it for the scene topic; `holding` is the id of what is held."""
        return {
            "holding": holding,
            "class": self.kind or None,
            "told": self.reported or None,
            "felt": self.touch.grip.value,
            "confirmed": self.is_confirmed,
            "width_m": round(self.touch.width_m, 4) if self.touch.is_held else None,
            "drift_m": round(self.touch.drift_m, 4),
            "effort_ratio": round(self.touch.closing_ratio, 3),
            "cause": self.cause,
        }


class Hands:
    """Follow the fingers of every hand in control's joint states."""

    def __init__(self, robot: RobotDescription) -> None:
        index = robot.joint_index
        self._grippers = {
            name: (index[robot.gripper_joint(name)], hand) for name, hand in robot.hands.items()
        }
        self._touches = {name: Touch() for name in robot.hands}
        self._stamp_ns = 0

    def update(self, sample: Sample) -> None:
        """Process a sample of `joint_state`, once."""
        if sample.stamp_ns <= self._stamp_ns:
            return
        self._stamp_ns, data = sample.stamp_ns, sample.data
        for name, (joint, hand) in self._grippers.items():
            fingers = FingerSample(
                stamp_ns=sample.stamp_ns,
                opening_m=hand.opening_m(float(data["position"][joint])),
                goal_m=hand.opening_m(float(data["setpoint"][joint])),
                speed_m_s=hand.opening_ratio * float(data["velocity"][joint]),
                closing_ratio=-float(data["effort_ratio"][joint]),
                is_powered=bool(data["torque_enabled"][joint]),
            )
            self._touches[name] = feel(self._touches[name], fingers)

    def holds(self, reported: Mapping[str, Any], now_ns: int) -> dict[str, Hold]:
        """Return what each hand holds; `reported` is what the executor names, by hand."""
        is_felt = now_ns - self._stamp_ns <= STALE_FINGERS_NS
        return {
            name: _hold(str(reported.get(name) or ""), touch if is_felt else Touch())
            for name, touch in self._touches.items()
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class HandState:
    """Hold what a hand holds, and where its grip is in the base frame."""

    name: str
    hold: Hold
    grip: Point


class BodyState:
    """Hold the joints' positions over time, from control's joint states."""

    def __init__(self, robot: RobotDescription, model: RobotModel) -> None:
        """Read the body's shapes."""
        self._robot = robot
        self._model = model
        self._mask = BodyMask(model)
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


def _hold(reported: str, touch: Touch) -> Hold:
    """Join report and touch: what is not felt is not held, what is only felt has no class."""
    kind, cause, is_confirmed = "", touch.cause, True
    if touch.is_held:
        kind, cause = reported or OTHER, ""
    elif touch.grip in (Grip.UNKNOWN, Grip.CLOSING):
        kind, is_confirmed = reported, False
    elif reported and not cause:
        cause = "nothing is felt between the fingers"
    return Hold(kind=kind, reported=reported, touch=touch, is_confirmed=is_confirmed, cause=cause)
