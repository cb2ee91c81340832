"""Move joints and the hand by keys or sticks: a pose that goes on as long as a person asks for it.

Who asks is a `JogInput`; it asks for nothing as soon as its dead-man control is let go.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.control.motion.axes import AxesState
from vla_deploy.control.motion.dispatch import axis_limits
from vla_deploy.control.motion.profile_motion import plan_stop
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.teleoperation.hand_pose import Floats, HandPose

JOINT_SPEED_RATIO: Final = 0.25
"""Of a joint's top speed with a key held or a stick at its end: as `joint move`."""
HAND_SPEED_M_S: Final = 0.08
LEAD_RAD: Final = 0.1
"""The pose is never further ahead of the setpoints: what is let go stops soon."""
_LONGEST_STEP_S: Final = 0.1
_DAMPING: Final = 0.02
_ROTATION_M_PER_RAD: Final = 0.05
"""What turning the hand counts beside moving it: arms of five joints cannot keep it as it is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JogWish:
    """Say what is asked for, each from -1 to 1: joints by name, the hand's x, y, z in the base."""

    joints: Mapping[str, float] = field(default_factory=dict)
    hand: tuple[float, float, float] = (0.0, 0.0, 0.0)


class JogInput(Protocol):
    """Declare what a keyboard and a gamepad give."""

    def wish(self) -> JogWish:
        """Return what is asked for now; nothing without the dead-man control.

        Raises:
            HandMotionEnded: it is lost.
        """
        ...


class JogHand:
    """Give a pose that moves as somebody asks, from where the joints stand."""

    def __init__(
        self,
        robot: RobotDescription,
        clock: Clock,
        source: JogInput,
        setpoints: Callable[[], Floats | None],
    ) -> None:
        """Follow `source`; `setpoints` gives those of all joints, None where control is silent."""
        self._robot = robot
        self._clock = clock
        self._source = source
        self._setpoints = setpoints
        self._position: Floats | None = None
        self._velocity = np.zeros(len(robot.joint_names))
        self._stamp_ns = clock.now_ns()
        travel = np.array([one.travel_per_rad for one in robot.servo_bus.servos])
        self._limits = axis_limits(robot)
        self._lead = LEAD_RAD * travel
        hands = list(robot.hands.values())
        self._site = hands[0].grip_site if hands else ""
        self._columns = (
            [robot.joint_index[one] for one in robot.group(hands[0].arm).joints] if hands else []
        )
        self._model: RobotModel | None = None

    @property
    def joints(self) -> Sequence[str]:
        """Return all of the robot's joints."""
        return self._robot.joint_names

    def read(self) -> HandPose | None:
        """Return the pose after the time that has passed.

        Raises:
            HandMotionEnded: what moves it is lost.
        """
        wish = self._source.wish()
        now_ns = self._clock.now_ns()
        step_s = min((now_ns - self._stamp_ns) / NS_PER_S, _LONGEST_STEP_S)
        self._stamp_ns = now_ns
        setpoints = self._setpoints()
        if setpoints is None:
            return None
        before = setpoints if self._position is None else self._position
        wanted = self._wanted_velocity(wish, before)
        after = np.where(wanted == 0.0, self._rest_of(before), before + wanted * step_s)
        after = np.clip(after, setpoints - self._lead, setpoints + self._lead)
        after = np.clip(after, self._robot.position_min, self._robot.position_max)
        is_held = np.abs(after - before) < np.abs(wanted) * step_s / 2
        self._position, self._velocity = after, np.where(is_held, 0.0, wanted)
        return HandPose(position=after, velocity=self._velocity)

    def _rest_of(self, position: Floats) -> Floats:
        """Return where joints rest that brake now: back to where they were let go is no way."""
        now = AxesState(
            position=position, velocity=self._velocity, acceleration=np.zeros_like(position)
        )
        return plan_stop(now, self._limits).target

    def _wanted_velocity(self, wish: JogWish, position: Floats) -> Floats:
        velocity = np.zeros(len(position))
        if any(wish.hand) and self._site:
            velocity[self._columns] = self._hand_velocity(wish.hand, position)
        for joint, ratio in wish.joints.items():
            row = self._robot.joint_index[joint]
            velocity[row] = ratio * JOINT_SPEED_RATIO * self._robot.velocity_max[row]
        return velocity

    def _hand_velocity(self, wanted: tuple[float, float, float], position: Floats) -> Floats:
        """Return the arm's joint velocities: damped least squares, slower near a singularity."""
        if self._model is None:
            self._model = RobotModel(self._robot)
        model = self._model
        rotation = model.site_pose(self._site, position)[:3, :3]
        jacobian = model.site_jacobian(self._site, position)[:, self._columns]
        jacobian = np.vstack([rotation @ jacobian[:3], _ROTATION_M_PER_RAD * jacobian[3:]])
        twist = np.concatenate([HAND_SPEED_M_S * np.array(wanted), np.zeros(3)])
        squared = jacobian @ jacobian.T + _DAMPING**2 * np.eye(6)
        arm: Floats = jacobian.T @ np.linalg.solve(squared, twist)
        most = JOINT_SPEED_RATIO * self._robot.velocity_max[self._columns]
        return arm / max(1.0, float((np.abs(arm) / most).max()))
