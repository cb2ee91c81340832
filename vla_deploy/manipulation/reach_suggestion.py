"""Suggest `[reach]` of an arm, by asking inverse kinematics for one point after the other."""

import math
from itertools import pairwise
from typing import Final

import numpy as np

from vla_deploy.manipulation.downward_reach import DownwardReach
from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.reach import Reach

_STEPS: Final = 25
"""How many samples an arm is long."""
_LOWEST_M: Final = 0.01
"""Of a grip: below it the finger tips would be in the table."""
_ROWS_MISSED: Final = 2
_MOST_ABOVE_M: Final = 0.1
_CLEAR_RATIO: Final = 0.75
"""Of the grip heights: at the highest an arm gets to the best distance alone."""
_APART_M: Final = 0.04
"""The narrowest half of a hand, of the arms that come with the stack."""
_PUT_STEP_M: Final = 0.05
_PUT_STEPS: Final = (0, 1, -1, 2, -2)
_TWO_YAWS_RAD: Final = (0.0, math.pi / 2)

Plane = set[tuple[float, float]]


def suggested_reach(robot: RobotDescription) -> Reach:
    """Return where the hands of a robot get to, pointing straight down: a `[reach]` to begin with.

    Whether an arm touches itself or the table on its way is not looked at.

    Raises:
        PostureUnreachable: no hand gets anywhere, pointing straight down.
    """
    survey = _Survey(robot)
    rows = survey.rows()
    if not rows:
        raise PostureUnreachable(
            f"{robot.name}: no hand that points straight down gets to a point before its shoulder; "
            "expected a grip_site whose z points out of the hand, and an arm of five joints or more"
        )
    best_z_m = max(rows, key=lambda z_m: len(rows[z_m]))
    places = rows[best_z_m] | survey.around(best_z_m, rows[best_z_m])
    best_x_m = float(np.median(sorted(x_m for x_m, _ in rows[best_z_m])))
    at_best_m = [z_m for z_m, row in rows.items() if _near(best_x_m, row, 0.5 * survey.step_m)]
    low_m, high_m, aside_m = min(at_best_m), max(at_best_m), survey.aside_m
    # The outermost ring is reached at one height only.
    farthest_m = max(math.hypot(*one) for one in places) - survey.step_m
    spots = _spots(places, best_x_m, aside_m, survey.step_m)
    return Reach(
        distances_m=(round(math.hypot(best_x_m, aside_m), 2), _down(farthest_m)),
        least_ahead_m=0.0 if robot.parts.base is None else _down(min(x for x, _ in places)),
        most_aside_m=_down(max(abs(y_m) for _, y_m in places)),
        grip_heights_m=(low_m, high_m),
        clear_height_m=round(low_m + _CLEAR_RATIO * (high_m - low_m), 2),
        out_m=_down(min(x_m for x_m, _ in rows[best_z_m])),
        above_m=max(0.01, min(_MOST_ABOVE_M, _down(0.5 * (high_m - low_m)))),
        put_ahead_m=spots[0],
        put_aside_m=spots[1],
        apart_m=max(_APART_M, *(round(0.5 * robot.widest_m(hand), 2) for hand in robot.hands)),
    )


class _Survey:
    """Sample a robot's hands in a grid as fine as suits the length of its arms."""

    def __init__(self, robot: RobotDescription) -> None:
        self._hands = DownwardReach(robot, _TWO_YAWS_RAD, restarts=1)
        arms = self._hands.arms.values()
        zero = np.clip(0.0, robot.position_min, robot.position_max)
        self._length_m = max(
            sum(float(np.linalg.norm(b - a)) for a, b in pairwise(arm.points(zero))) for arm in arms
        )
        self.step_m = max(0.01, round(self._length_m / _STEPS, 2))
        self._highest_m = max(float(arm.shoulder_m[2]) for arm in arms) + self._length_m
        self.aside_m = round(max(abs(float(arm.shoulder_m[1])) for arm in arms), 2)

    def rows(self) -> dict[float, Plane]:
        """Return the points before the shoulders to which hands get, by their height."""
        found: dict[float, Plane] = {}
        missed = 0
        for z_m in self._steps(_LOWEST_M, self._highest_m):
            if row := self._ahead(z_m):
                found[z_m], missed = row, 0
            elif found and (missed := missed + 1) == _ROWS_MISSED:
                break
        return found

    def _ahead(self, z_m: float) -> Plane:
        """Return the points at a height before the shoulders to which their hands get."""
        return {
            (x_m, y_m)
            for hand, arm in self._hands.arms.items()
            for x_m in self._steps(0.0, float(arm.shoulder_m[0]) + self._length_m)
            for y_m in [round(float(arm.shoulder_m[1]), 3)]
            if math.dist((x_m, y_m, z_m), arm.shoulder_m) < self._length_m
            and self._hands.has(hand, (x_m, y_m, z_m))
        }

    def around(self, z_m: float, row: Plane) -> Plane:
        """Return the points at a height in front of the base to which some hand gets.

        Only those are tried that are as far from a shoulder as the `row` before it.
        """
        found: Plane = set()
        for hand, arm in self._hands.arms.items():
            shoulder_m = (float(arm.shoulder_m[0]), float(arm.shoulder_m[1]))
            away_m = [
                math.dist(one, shoulder_m) for one in row if abs(one[1] - shoulder_m[1]) < 1e-3
            ]
            if not away_m:
                continue
            for x_m in self._steps(0.0, shoulder_m[0] + max(away_m) + self.step_m):
                for turn in self._steps(-max(away_m), max(away_m) + self.step_m):
                    point_m = (x_m, round(shoulder_m[1] + turn, 3))
                    is_like = min(away_m) <= math.dist(point_m, shoulder_m) <= max(away_m)
                    if is_like and self._hands.has(hand, (*point_m, z_m)):
                        found.add(point_m)
        return found

    def _steps(self, low_m: float, high_m: float) -> list[float]:
        return [round(float(one), 3) for one in np.arange(low_m, high_m, self.step_m)]


def _near(x_m: float, row: Plane, step_m: float) -> bool:
    return any(abs(one - x_m) <= step_m for one, _ in row)


def _spots(
    places: Plane, x_m: float, aside_m: float, step_m: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return x and y of spots around the best one, that first."""

    def reached(spot: tuple[float, float]) -> bool:
        return any(math.dist(spot, one) <= step_m for one in places)

    asides_m = [round(aside_m + step * _PUT_STEP_M, 2) for step in _PUT_STEPS]
    aheads_m = [round(x_m + 0.5 * step * _PUT_STEP_M, 2) for step in _PUT_STEPS]
    return (
        tuple(one for one in aheads_m if reached((one, aside_m))),
        tuple(one for one in asides_m if reached((x_m, one))),
    )


def _down(value_m: float) -> float:
    return math.floor(100.0 * value_m + 1e-6) / 100.0
