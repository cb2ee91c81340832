import itertools
import math
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.robots.kinematics.model import full_positions
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.movements.arms import move_arm
from vla_deploy.skills.movements.underside import BESIDE_M, STEP_BACK_M, way_back_m

if TYPE_CHECKING:
    from conftest import StandingLink

HANGING_OUT = (("left_shoulder_pitch", 0.3), ("left_elbow", 0.8), ("left_wrist_pitch", -1.0))


@pytest.fixture
def reaching(context: SkillContext, standing: "StandingLink") -> float:
    """Hold the left arm out, low in front; return how far in front its grip is."""
    context.arms = {side: ArmKinematics(context.robot, side) for side in context.robot.hands}
    standing.positions = full_positions(context.robot, HANGING_OUT)
    return float(context.arms["left"].points(standing.positions)[:, 0].max())


def table(near_x_m: float, height_m: float = 0.9, deep_m: float = 1.0) -> dict[str, Any]:
    """Return a surface as wide as the room that begins so far in front of the robot at (1, 2)."""
    low, high = 1.0 + near_x_m, 1.0 + near_x_m + deep_m
    return {"height_m": height_m, "polygon_m": [[low, 0.0], [high, 0.0], [high, 4.0], [low, 4.0]]}


def test_an_arm_with_nothing_over_it_needs_no_way_back(
    context: SkillContext, standing: "StandingLink", reaching: float
) -> None:
    standing.surfaces = [table(reaching + BESIDE_M + 0.01), table(0.0, height_m=0.1)]
    assert way_back_m(context) == 0.0


@pytest.mark.parametrize("inside_m", [0.02, 0.2])
def test_the_way_back_is_as_long_as_the_arm_reaches_in(
    context: SkillContext, standing: "StandingLink", reaching: float, inside_m: float
) -> None:
    standing.surfaces = [table(reaching - inside_m)]
    least_m = inside_m + BESIDE_M
    assert least_m <= way_back_m(context) <= least_m + STEP_BACK_M


def test_an_arm_that_no_way_back_frees_is_told_of(
    context: SkillContext, standing: "StandingLink", reaching: float
) -> None:
    standing.surfaces = [table(reaching - 3.0, deep_m=6.0)]
    with pytest.raises(NotPossible, match="left arm is under a table"):
        way_back_m(context)


def test_an_arm_alone_does_not_rise_under_a_table(
    context: SkillContext, standing: "StandingLink", reaching: float
) -> None:
    standing.surfaces = [table(reaching - 0.1)]
    with pytest.raises(NotPossible, match=r"have me drive 0\.20 m back first"):
        list(move_arm(context, {"pose": "tuck"}))


def test_points_run_from_the_shoulder_to_the_grip(context: SkillContext, reaching: float) -> None:
    points_m = context.arms["left"].points(full_positions(context.robot, HANGING_OUT))
    assert len(points_m) == 7
    ways_m = [math.dist(a, b) for a, b in itertools.pairwise(points_m)]
    assert max(ways_m) < 0.4
