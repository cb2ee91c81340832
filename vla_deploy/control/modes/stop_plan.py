"""Say which joints lose power when, by the stop category of their group and by what it carries."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.motion.axes import Axes
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.safety import Reaction


class StopPlan:
    """Hold the stop categories of a robot's joints and of its base.

    A hand that holds something counts as category 2, and its arm with it: what ramps and holds
    drops nothing. A group that the robot file lets `drop_payload` keeps its own category.
    """

    def __init__(self, robot: RobotDescription) -> None:
        category = {
            joint: group.stop_category for group in robot.groups.values() for joint in group.joints
        }
        joints = [category[name] for name in robot.joint_names]
        self.base = min(
            (category[joint] for joint in robot.wheel_joints),
            default=StopCategory.STOP_THEN_REMOVE_POWER,
        )
        self._strictest = min(joints)
        if robot.wheel_joints:
            self._strictest = min(self._strictest, self.base)
        self.every_joint: Axes = np.arange(len(joints))
        self._joints = np.array(joints)
        self._carrying = {
            name: _carrying_joints(robot, (hand.arm, hand.gripper))
            for name, hand in robot.hands.items()
        }

    def unpowered_at_once(self, reaction: Reaction, holding: Collection[str] = ()) -> Axes:
        """Return the joints whose power goes with the first tick of a stop."""
        if reaction is not Reaction.GROUP_STOP:
            return self.every_joint[:0]
        return np.flatnonzero(self._categories(holding) == StopCategory.POWER_REMOVED)

    def unpowered_at_rest(self, reaction: Reaction, holding: Collection[str] = ()) -> Axes:
        """Return the joints whose power goes when everything has come to rest."""
        return self.released(holding) if reaction is Reaction.GROUP_STOP else self.every_joint[:0]

    def released(self, holding: Collection[str] = ()) -> Axes:
        """Return the joints that a disarmed robot leaves without power: all but category 2."""
        return np.flatnonzero(self._categories(holding) != StopCategory.STOP_KEEP_POWER)

    def switched_off(self, holding: Collection[str]) -> Axes:
        """Return the joints that lose power when a person switches the robot off.

        That is all, but what a hand holds is not dropped: it keeps its power, and its arm.
        """
        off = np.ones(len(self._joints), np.bool_)
        for hand in holding:
            off[self._carrying[hand]] = False
        return np.flatnonzero(off)

    def base_category(self, reaction: Reaction) -> StopCategory:
        """Return how the base stops."""
        if reaction is Reaction.BASE_OFF:
            return min(self.base, StopCategory.STOP_THEN_REMOVE_POWER)
        return self.base if reaction is Reaction.GROUP_STOP else StopCategory.STOP_KEEP_POWER

    def category(self, reaction: Reaction) -> StopCategory:
        """Return the lowest category by which a part stops; what a hand holds does not count."""
        return self._strictest if reaction is Reaction.GROUP_STOP else self.base_category(reaction)

    def _categories(self, holding: Collection[str]) -> NDArray[np.int64]:
        categories = self._joints.copy()
        for hand in holding:
            categories[self._carrying[hand]] = StopCategory.STOP_KEEP_POWER
        return categories


def _carrying_joints(robot: RobotDescription, groups: tuple[str, ...]) -> Axes:
    """Return the joints of these groups, but for those that may drop what they hold."""
    kept = [robot.groups[name] for name in groups if not robot.groups[name].drop_payload]
    index = robot.joint_index
    return np.array([index[joint] for group in kept for joint in group.joints], dtype=np.intp)
