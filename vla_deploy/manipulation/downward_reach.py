"""Find by inverse kinematics where hands that point straight down get to, and judge `[reach]`."""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product
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
Promise = tuple[str, Sequence[float], Callable[[float], Iterator[Point]], str]


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

    Each distance has to be reached at one of the heights, and the reverse, each x at one of the y.
    """
    reach = robot.parts.reach
    if reach is None or not robot.hands:
        return
    hands = DownwardReach(robot)
    for key, values, points_of, expected in _promises(reach):
        for i, value in enumerate(values):
            if not any(map(hands.any_has, points_of(value))):
                yield TableFault(
                    key=f"reach.{key}[{i}]",
                    got=f"{value:g}",
                    expected=f"{expected}, pointing straight down: vla-deploy robot reach "
                    f"--robot {name} prints a table that fits the arm",
                )


def _promises(reach: Reach) -> Iterator[Promise]:
    """Yield the keys that name places, with the points of which a hand has to get to one."""
    low_m, high_m = reach.grip_heights_m
    heights_m = (low_m, 0.5 * (low_m + high_m), high_m)

    def at_distance(distance_m: float) -> Iterator[Point]:
        return _around(reach, (distance_m,), heights_m)

    def at_height(height_m: float) -> Iterator[Point]:
        return _around(reach, reach.distances_m, (height_m,))

    def ahead(ahead_m: float) -> Iterator[Point]:
        asides_m = [side * one for one in reach.put_aside_m for side in (1.0, -1.0)]
        yield from product((ahead_m,), asides_m, heights_m)

    a_hand = "that a hand gets to at one of"
    yield "distances_m", reach.distances_m, at_distance, f"one {a_hand} grip_heights_m"
    yield "grip_heights_m", reach.grip_heights_m, at_height, f"one {a_hand} distances_m"
    yield "put_ahead_m", reach.put_ahead_m, ahead, f"one {a_hand} put_aside_m"


def _around(
    reach: Reach, distances_m: Sequence[float], heights_m: Sequence[float]
) -> Iterator[Point]:
    """Yield points at some distances and heights that the bounds of the reach let in."""
    for distance_m in distances_m:
        for bearing_rad in _BEARINGS_RAD:
            x_m, y_m = distance_m * math.cos(bearing_rad), distance_m * math.sin(bearing_rad)
            if reach.has((x_m, y_m)):
                yield from ((x_m, y_m, z_m) for z_m in heights_m)
