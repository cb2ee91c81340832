"""Tell which hands hold something: told by the executor, or felt by the gripper itself."""

from typing import Final

import numpy as np

from vla_deploy.control.motion.axes import Flags, Floats
from vla_deploy.ipc import CellReader
from vla_deploy.ipc.payloads.tasks import ExecutorStatus
from vla_deploy.robots import RobotDescription

# An empty gripper closes to where it was sent; fingers on an object stop short of it, pressing.
SHORT_OF_GOAL_M: Final = 0.002
PRESSING_RATIO: Final = 0.05
PRESS_M: Final = 0.008
"""So much narrower than what it holds a hand is sent; its Goal PWM bounds the force."""


class Payload:
    """Look at the hands when a stop has to know; a held thing outlives the executor."""

    def __init__(
        self, robot: RobotDescription, executor_status: CellReader[ExecutorStatus]
    ) -> None:
        self._grippers = {
            name: [robot.joint_index[joint] for joint in robot.group(hand.gripper).joints]
            for name, hand in robot.hands.items()
        }
        ratio = np.ones(len(robot.joint_names))
        for name, hand in robot.hands.items():
            ratio[self._grippers[name]] = hand.opening_ratio
        self._short, self._press = SHORT_OF_GOAL_M / ratio, PRESS_M / ratio
        """In the grippers' own coordinates: metres of a finger, or radians of a jaw."""
        self._low = robot.position_min
        self._status = executor_status

    def holding(
        self, position: Floats, setpoint: Floats, effort_ratio: Floats, torque_on: Flags
    ) -> frozenset[str]:
        """Return the hands that hold something, in doubt too many of them."""
        short = position - setpoint > self._short
        pressing = short & (abs(effort_ratio) > PRESSING_RATIO) & torque_on
        felt = {name for name, joints in self._grippers.items() if pressing[joints].any()}
        return frozenset(felt | self._told())

    def pressed(self, position: Floats, effort_ratio: Floats) -> Floats:
        """Return where setpoints may begin anew: at the joints, but fingers that hold something
        are sent further, for a hand that is sent to where it is presses no more.

        A robot that has just been started is told nothing: there the closing motor itself tells.
        """
        begin, told = position.copy(), self._told()
        for name, joints in self._grippers.items():
            if name in told or (effort_ratio[joints] < -PRESSING_RATIO).any():
                pressing = position[joints] - self._press[joints]
                begin[joints] = np.maximum(pressing, self._low[joints])
        return begin

    def close(self) -> None:
        """Unmap the topic."""
        self._status.close()

    def _told(self) -> set[str]:
        sample = self._status.latest()
        holding = {} if sample is None else sample.document().get("holding", {})
        return {name for name in self._grippers if holding.get(name)}
