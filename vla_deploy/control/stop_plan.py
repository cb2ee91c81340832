"""Say which joints lose power when, by the stop category of their group."""

import numpy as np

from vla_deploy.control.axes import Axes
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.safety import Reaction


class StopPlan:
    """Hold the stop categories of a robot's joints and of its base."""

    def __init__(self, robot: RobotDescription) -> None:
        category = {
            joint: group.stop_category for group in robot.groups.values() for joint in group.joints
        }
        joints = [category[name] for name in robot.joint_names]
        self.base = min(category[drive.joint] for drive in robot.can_bus.drives)
        self.every_joint: Axes = np.arange(len(joints))
        self._joints = np.array(joints)

    def unpowered_at_once(self, reaction: Reaction) -> Axes:
        """Return the joints whose power goes with the first tick of a stop."""
        if reaction is not Reaction.GROUP_STOP:
            return self.every_joint[:0]
        return np.flatnonzero(self._joints == StopCategory.POWER_REMOVED)

    def unpowered_at_rest(self, reaction: Reaction) -> Axes:
        """Return the joints whose power goes when everything has come to rest."""
        return self.released if reaction is Reaction.GROUP_STOP else self.every_joint[:0]

    @property
    def released(self) -> Axes:
        """Return the joints that a disarmed robot leaves without power: all but category 2."""
        return np.flatnonzero(self._joints != StopCategory.STOP_KEEP_POWER)

    def base_category(self, reaction: Reaction) -> StopCategory:
        """Return how the base stops."""
        if reaction is Reaction.BASE_OFF:
            return min(self.base, StopCategory.STOP_THEN_REMOVE_POWER)
        return self.base if reaction is Reaction.GROUP_STOP else StopCategory.STOP_KEEP_POWER
