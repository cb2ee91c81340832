"""Have the robot's joints follow a hand's pose, by goals that replace each other.

Control plans each goal time-optimally to rest, within the joints' limits and judged by safety. The
goal is where the hand would come to rest if it braked as hard as the joints can: so the joints
pass the hand's pose at its speed, instead of braking for it. When no goal comes any more they rest
there.
"""

from typing import Final

import numpy as np

from vla_deploy.client.motions import GRIPPER_EFFORT_RATIO, Motions
from vla_deploy.client.path_player import DONE
from vla_deploy.client.readiness import SILENT
from vla_deploy.control.motion.axes import AxesState
from vla_deploy.control.motion.dispatch import axis_limits
from vla_deploy.control.motion.profile_motion import plan_stop
from vla_deploy.robots import RobotDescription
from vla_deploy.teleoperation.errors import HandMotionEnded
from vla_deploy.teleoperation.hand_pose import Floats, HandInput, HandPose

PERIOD_S: Final = 0.02
"""From one goal to the next: control takes 1.4 ms of a core to plan one for six joints."""
NEAR_RAD: Final = 0.2
"""Further from the hand's pose nothing moves without `approach`."""
REACHED_RAD: Final = 0.05
APPROACH_SPEED_RATIO: Final = 0.2
BEYOND_RAD: Final = 0.35
"""Leaders have other stops than robots: up to here beyond a limit the joint stays at the limit."""
_SAME_RAD: Final = 0.001
"""Goals nearer than this to the last are not sent: a pulse is 0.0015 rad."""


class HandFollowing:
    """Send a goal for each pose, slowly until the joints have met the hand."""

    def __init__(
        self, motions: Motions, robot: RobotDescription, hand: HandInput, *, approach: bool
    ) -> None:
        """Let the joints come to a pose that is far away only with `approach`."""
        self.goals = 0
        self.largest_distance = 0.0
        """Of setpoints from the hand's pose while following, in rad or m."""
        self.has_met = False
        self._motions = motions
        self._hand = hand
        self._approach = approach
        self._joints = tuple(hand.joints)
        axes = np.array([robot.joint_index[one] for one in self._joints], dtype=np.intp)
        self._limits = axis_limits(robot).of(axes)
        self._low, self._high = robot.position_min[axes], robot.position_max[axes]
        travel = {one.joint: one.travel_per_rad for one in robot.servo_bus.servos}
        self._per_rad = np.array([travel[one] for one in self._joints])
        self._efforts = dict.fromkeys(
            robot.gripper_joints & set(self._joints), GRIPPER_EFFORT_RATIO
        )
        self._is_gripper = np.array([one in robot.gripper_joints for one in self._joints])
        self._motion_id: int | None = None
        self._sent: Floats | None = None

    def step(self) -> None:
        """Read the hand once, and send a goal where it has moved.

        Raises:
            HandMotionEnded: the hand is lost or too far away, or control ended the motion.
        """
        self._require_going_on()
        pose = self._hand.read()
        if pose is None:
            return
        self._require_within(pose)
        view = self._motions.look(self._joints)
        if view is None:
            raise HandMotionEnded(SILENT)
        wanted = np.clip(pose.position, self._low, self._high)
        distance = np.abs(view.setpoint - wanted)
        if not self.has_met:
            self._come_near(wanted, distance)
        if self.has_met:
            self.largest_distance = max(self.largest_distance, float(distance.max()))
            self._go(self._rest_of(pose), 1.0)

    def _rest_of(self, pose: HandPose) -> Floats:
        """Return where the hand would rest if it braked as the joints can."""
        speed = np.clip(pose.velocity, -self._limits.velocity, self._limits.velocity)
        now = AxesState(position=pose.position, velocity=speed, acceleration=np.zeros_like(speed))
        return np.clip(plan_stop(now, self._limits).target, self._low, self._high)

    def _come_near(self, wanted: Floats, distance: Floats) -> None:
        ratio = distance / self._per_rad
        worst = int(ratio.argmax())
        if ratio[worst] <= REACHED_RAD:
            self.has_met = True
            return
        if not self._approach and self._motion_id is None and ratio[worst] > NEAR_RAD:
            raise HandMotionEnded(
                f"{self._joints[worst]} is {distance[worst]:.2f} from the leader's, at most "
                f"{NEAR_RAD * self._per_rad[worst]:.2g}: bring the leader to the robot's pose, or "
                "let the robot come slowly with --approach"
            )
        self._go(wanted, APPROACH_SPEED_RATIO)

    def _go(self, target: Floats, speed_ratio: float) -> None:
        if (
            self._sent is not None
            and (np.abs(target - self._sent) < _SAME_RAD * self._per_rad).all()
        ):
            return
        last = self._motion_id
        goal = dict(zip(self._joints, target.tolist(), strict=True))
        is_slow = speed_ratio < 1.0
        self._motion_id = self._motions.go(goal, self._efforts, speed_ratio, together=is_slow)
        self._sent = target
        self.goals += 1
        if last is not None:
            self._motions.forget(last)

    def _require_going_on(self) -> None:
        self._motions.step()
        ended = None if self._motion_id is None else self._motions.ended(self._motion_id)
        if ended is not None and ended.status != DONE:
            raise HandMotionEnded(f"{ended.status}, {ended.reason}")

    def _require_within(self, pose: HandPose) -> None:
        beyond = np.maximum(self._low - pose.position, pose.position - self._high)
        beyond = np.where(self._is_gripper, 0.0, beyond / self._per_rad)
        worst = int(beyond.argmax())
        if beyond[worst] > BEYOND_RAD:
            raise HandMotionEnded(
                f"the leader's {self._joints[worst]} is at {pose.position[worst]:.2f}, expected "
                f"{self._low[worst]:g} to {self._high[worst]:g}: bring it back, or calibrate it"
            )
