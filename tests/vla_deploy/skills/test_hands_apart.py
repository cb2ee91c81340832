"""Butler's ways between its poses keep its hands apart by more than where it would be stopped."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.control.motion.axes import AxesState
from vla_deploy.control.motion.dispatch import axis_limits
from vla_deploy.control.motion.profile_motion import plan_motion
from vla_deploy.manipulation.errors import ManipulationError
from vla_deploy.manipulation.grasps import hand_down
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import full_positions
from vla_deploy.skills.movements.carrying import RESTARTS

Floats = NDArray[np.float64]

BUTLER = load_robot("butler")
SHAPES = BodyShapes(BUTLER)
LIMITS = axis_limits(BUTLER)
APART_M = 0.02
OPEN_M = 0.044
BETWEEN_ARMS = np.array(
    [
        {first.partition("_")[0], second.partition("_")[0]} == {"left", "right"}
        for first, second in SHAPES.self_pairs
    ]
)


def posture(name: str) -> Floats:
    """Return a pose of the robot file with both hands wide open."""
    wide = [("left_gripper", OPEN_M), ("right_gripper", OPEN_M)]
    return full_positions(BUTLER, [*BUTLER.poses[name].items(), *wide])


def least_m(start: Floats, end: Floats) -> float:
    """Return how near the arms come to each other on the way."""
    still = np.zeros_like(start)
    begin = AxesState(position=start, velocity=still, acceleration=still.copy())
    way = plan_motion(begin, end, LIMITS)
    times_s = np.linspace(0.0, way.duration_s, 30)
    return min(
        float(SHAPES.distances(way.sample(t).position)[0][BETWEEN_ARMS].min()) for t in times_s
    )


def postures_down(hand: str, points_m: list[tuple[float, float, float]]) -> Iterator[Floats]:
    """Yield postures in which one hand points down over furniture and the other is tucked."""
    arm, tuck = ArmKinematics(BUTLER, hand), posture("tuck")
    columns = [BUTLER.joint_index[name] for name in BUTLER.group(BUTLER.hands[hand].arm).joints]
    for point_m in points_m:
        for yaw_rad in np.arange(0.0, 2 * math.pi, math.pi / 3):
            try:
                solved = arm.solve(hand_down(point_m, yaw_rad), tuck, restarts=RESTARTS).positions
            except ManipulationError:
                continue
            found = tuck.copy()
            found[columns] = solved[columns]
            yield found


def test_both_arms_rise_from_the_base_side_by_side() -> None:
    assert least_m(posture("rest"), posture("tuck")) > APART_M


@pytest.mark.parametrize("hand", ["left", "right"])
def test_a_hand_comes_home_from_wherever_it_grasps_and_carries(hand: str) -> None:
    side, carry_point_m = 1.0 if hand == "left" else -1.0, BUTLER.hands[hand].carry_point_m
    assert carry_point_m is not None
    points_m = [(x, side * y, z) for x in (0.36, 0.48) for y in (-0.05, 0.12) for z in (0.6, 0.8)]
    points_m.append(carry_point_m)
    tuck = posture("tuck")
    ways = [least_m(there, tuck) for there in postures_down(hand, points_m)]
    assert len(ways) > 10
    assert min(ways) > APART_M


def test_both_hands_loaded_are_apart() -> None:
    points_m = {
        name: [one.carry_point_m] for name, one in BUTLER.hands.items() if one.carry_point_m
    }
    (left, *_), (right, *_) = (
        list(postures_down(hand, points_m[hand])) for hand in ("left", "right")
    )
    both = left.copy()
    columns = [BUTLER.joint_index[name] for name in BUTLER.group("right_arm").joints]
    both[columns] = right[columns]
    assert least_m(posture("tuck"), both) > APART_M
