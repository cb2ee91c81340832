"""Find by inverse kinematics where hands that point straight down get to, and judge `[reach]`."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.reach import Reach
from vla_deploy.runtime.table_schema import TableFault

YAWS_RAD: Final = (0.0, math.pi / 4, math.pi / 2, 3 * math.pi / 4)
_BEARINGS_RAD: Final = tuple(math.radians(15.0 * step) for step in (0, 1, -1, 2, -2, 3, -3, 4, -4))
_RESTARTS: Final = 2

Point = tuple[float, float, float]


class DownwardReach:
    """Answer whether hands get to points of the base frame, pointing straight down."""

    def __init__(
        self,
        robot: RobotDescription,
        yaws_rad: Sequence[float] = YAWS_RAD,
        restarts: int = _RESTARTS,
    ) -> None:
        """Build the kinematics of every hand, each turned in these ways; one instance per thread.

        The fewer ways and restarts, the sooner it is known that a point is out of reach.
        """
        self.arms = {name: ArmKinematics(robot, name) for name in robot.hands}
        middle = 0.5 * (robot.position_min + robot.position_max)
        self._yaws_rad, self._restarts = yaws_rad, restarts
        self._seeds: dict[str, NDArray[np.float64]] = dict.fromkeys(self.arms, middle)

    def has(self, hand: str, point_m: Point) -> bool:
        """Return whether a hand gets there, turned in one of the ways about the vertical."""
        return any(self._solves(hand, point_m, yaw_rad) for yaw_rad in self._yaws_rad)

    def any_has(self, point_m: Point) -> bool:
        """Return whether some hand gets there."""
        return any(self.has(hand, point_m) for hand in self.arms)

    def _solves(self, hand: str, point_m: Point, yaw_rad: float) -> bool:
        target = hand_down(point_m, yaw_rad)
        try:
            found = self.arms[hand].solve(target, self._seeds[hand], restarts=self._restarts)
        except PostureUnreachable:
            return False
        self._seeds[hand] = found.positions  # the next point is likely near this one
        return True


def reach_faults(robot: RobotDescription, name: str) -> Iterator[TableFault]:
    """Yield what `[reach]` promises and no hand gets to; `name` is how a command names the robot.

    Each distance, height and spot has to be reached at one of the others.
    """
    reach = robot.parts.reach
    if reach is None or not robot.hands:
        return
    hands, (low_m, high_m) = DownwardReach(robot), reach.grip_heights_m
    heights_m = (low_m, 0.5 * (low_m + high_m), high_m)
    advice = f"; vla-deploy robot reach --robot {name} prints a table that fits the arm"
    for i, distance_m in enumerate(reach.distances_m):
        if not any(map(hands.any_has, _around(reach, (distance_m,), heights_m))):
            yield TableFault(
                key=f"reach.distances_m[{i}]",
                got=f"{distance_m:g}",
                expected="a distance from the base at which a hand gets to a height of "
                f"grip_heights_m, pointing straight down{advice}",
            )
    for i, height_m in enumerate(reach.grip_heights_m):
        if not any(map(hands.any_has, _around(reach, reach.distances_m, (height_m,)))):
            yield TableFault(
                key=f"reach.grip_heights_m[{i}]",
                got=f"{height_m:g}",
                expected="a height to which a hand that points straight down gets at one of "
                f"distances_m{advice}",
            )
    for i, ahead_m in enumerate(reach.put_ahead_m):
        spots = [(ahead_m, y_m, z_m) for y_m in reach.put_aside_m for z_m in heights_m]
        if not any(map(hands.any_has, [*spots, *((x_m, -y_m, z_m) for x_m, y_m, z_m in spots)])):
            yield TableFault(
                key=f"reach.put_ahead_m[{i}]",
                got=f"{ahead_m:g}",
                expected="a spot that a hand that points straight down gets to at one of "
                f"put_aside_m{advice}",
            )


def _around(
    reach: Reach, distances_m: Sequence[float], heights_m: Sequence[float]
) -> Iterator[Point]:
    """Yield points at some distances and heights that the bounds of the reach let in."""
    for distance_m in distances_m:
        for bearing_rad in _BEARINGS_RAD:
            x_m, y_m = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
            if reach.has((x_m, y_m)):
                yield from ((x_m, y_m, z_m) for z_m in heights_m)
