"""Hold what a robot can do to the world: where its base fits, what its hands reach and span."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.navigation.path_planning import PathPlanner, base_planner
from vla_deploy.plans.knowledge import spoken_places
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import Place
from vla_deploy.world import Body

# A thing is taken before the shoulder of the hand that takes it.
SIDE_M: Final = 0.12
_HEIGHT_STEP_M: Final = 0.01
_YAWS_RAD: Final = (0.0, math.pi / 4, math.pi / 2, 3 * math.pi / 4)
_SIGNS: Final = {"left": 1.0, "right": -1.0}


class Arms:
    """Compute at which heights a hand that points down gets to a point before its shoulder."""

    def __init__(self, robot: RobotDescription) -> None:
        self._arms = {name: ArmKinematics(robot, name) for name in robot.hands}
        self._distances_m = robot.parts.reach.distances_m if robot.parts.reach else ()
        self._seed = 0.5 * (robot.position_min + robot.position_max)
        self._answered = cache(self._reaches)

    def reach_height(self, hand: str, height_m: float) -> bool:
        """Return whether the hand gets to that height above the floor, to the centimetre."""
        return self._answered(hand, round(height_m / _HEIGHT_STEP_M))

    def _reaches(self, hand: str, step: int) -> bool:
        return any(self._solves(hand, one_m, step * _HEIGHT_STEP_M) for one_m in self._distances_m)

    def _solves(self, hand: str, reach_m: float, height_m: float) -> bool:
        aside_m = _SIGNS.get(hand, 0.0) * SIDE_M
        point_m = (math.sqrt(reach_m**2 - aside_m**2), aside_m, height_m)
        for yaw_rad in _YAWS_RAD:
            try:
                self._arms[hand].solve(hand_down(point_m, yaw_rad), self._seed, restarts=2)
            except PostureUnreachable:
                continue
            return True
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Abilities:
    """Hold a robot's body for judging goals; `spoken` maps every name of a place to the place."""

    body: Body
    arms: Arms
    planner: PathPlanner
    places: Mapping[str, Place]
    spoken: Mapping[str, str]
    poses: frozenset[str]

    @classmethod
    def of(cls, robot: RobotDescription, planner: PathPlanner | None = None) -> "Abilities":
        """Read what a robot file says of it; a caller with a planner for its base passes it.

        Raises:
            MapInvalid: its map cannot be used.
        """
        planner = planner or base_planner(robot)
        return cls(
            body=Body.of(robot, planner.is_free),
            arms=Arms(robot),
            planner=planner,
            places=robot.places,
            spoken=spoken_places(robot.places),
            poses=frozenset(robot.poses),
        )
