"""Where a butler's hands take a bottle on a table from the side, by kinematics and neighbours."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from vla_deploy.manipulation.grasps import GraspKind
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.errors import NotPossible, OutOfReach
from vla_deploy.skills.movements.grasp_choice import GraspChoice, choose_grasp, kinds_for

if TYPE_CHECKING:
    from conftest import StandingLink

TABLE_M, HALF_M = 0.5, 0.09
SIZE_M = (0.056, 0.056, 2 * HALF_M)
HANDS = ("left", "right")
Seen = dict[str, Any]


@pytest.fixture(autouse=True)
def tucked(context: SkillContext, standing: "StandingLink") -> None:
    robot = context.robot
    standing.setpoints = np.zeros(len(robot.joint_names))
    for name, value in robot.poses["tuck"].items():
        standing.setpoints[robot.joint_index[name]] = value


def seen(
    standing: "StandingLink",
    at_m: tuple[float, float],
    on_m: float = TABLE_M,
    kind: str = "bottle",
    size_m: tuple[float, float, float] = SIZE_M,
) -> Seen:
    return {
        "id": f"{kind}_{len(standing.objects)}",
        "class": kind,
        "colour": "green",
        "position_m": (*standing.pose.outward(*at_m), on_m + size_m[2] / 2),
        "size_m": list(size_m),
        "yaw_rad": 0.0,
    }


def surface(
    standing: "StandingLink", height_m: float, near_m: float, far_m: float = 0.9
) -> dict[str, Any]:
    corners = [(near_m, -0.5), (far_m, -0.5), (far_m, 0.5), (near_m, 0.5)]
    outline = [standing.pose.outward(*corner) for corner in corners]
    return {"name": "table", "height_m": height_m, "polygon_m": outline}


def heading_rad(choice: GraspChoice) -> float:
    x, y, _ = choice.way[-1][:3, 2]
    return math.atan2(y, x)


@pytest.mark.parametrize(
    ("at_m", "hand"),
    [((0.45, 0.12), "left"), ((0.5, 0.0), "left"), ((0.42, -0.15), "right")],
)
def test_a_bottle_on_a_table_is_taken_level_and_lifted(
    context: SkillContext, standing: "StandingLink", at_m: tuple[float, float], hand: str
) -> None:
    bottle = seen(standing, at_m)
    standing.objects, standing.surfaces = [bottle], [surface(standing, TABLE_M, 0.28)]
    assert kinds_for(context, bottle) == (GraspKind.TOP, GraspKind.SIDE)
    choice = choose_grasp(context, bottle, HANDS, GraspKind.SIDE, [])
    assert choice.hand == hand
    assert abs(choice.held.tilt_rad) == pytest.approx(math.pi / 2)
    assert choice.held.below_grip_m == pytest.approx(HALF_M)
    assert choice.lift_m >= 0.1
    assert choice.out is None


def test_the_hand_comes_in_where_neighbours_leave_it_room(
    context: SkillContext, standing: "StandingLink"
) -> None:
    bottle = seen(standing, (0.5, 0.1))
    cup_m = (0.066, 0.066, 0.095)
    ahead = seen(standing, (0.38, 0.1), kind="cup", size_m=cup_m)
    standing.objects = [bottle, ahead]
    choice = choose_grasp(context, bottle, HANDS, GraspKind.SIDE, [])
    assert abs(heading_rad(choice)) > 0.5
    around = [
        seen(standing, (0.5 + 0.1 * math.cos(a), 0.1 + 0.1 * math.sin(a)), kind="cup", size_m=cup_m)
        for a in np.linspace(math.pi / 2, 3 * math.pi / 2, 5)
    ]
    standing.objects = [bottle, *({**one, "id": f"cup_{n}"} for n, one in enumerate(around))]
    with pytest.raises(OutOfReach, match="no way in from the side"):
        choose_grasp(context, bottle, HANDS, GraspKind.SIDE, [])


def test_what_is_too_high_for_a_hand_from_above_is_taken_from_the_side(
    context: SkillContext, standing: "StandingLink"
) -> None:
    bottle = seen(standing, (0.45, 0.1), on_m=0.81)
    standing.objects, standing.surfaces = [bottle], [surface(standing, 0.81, 0.35)]
    with pytest.raises(OutOfReach):
        choose_grasp(context, bottle, HANDS, GraspKind.TOP, [])
    assert choose_grasp(context, bottle, HANDS, GraspKind.SIDE, []).grasp.kind is GraspKind.SIDE


def test_from_under_a_shelf_it_is_drawn_out_before_it_is_raised(
    context: SkillContext, standing: "StandingLink"
) -> None:
    bottle = seen(standing, (0.5, 0.1))
    standing.objects = [bottle]
    standing.surfaces = [surface(standing, TABLE_M, 0.28), surface(standing, 0.8, 0.45)]
    assert kinds_for(context, bottle) == (GraspKind.SIDE, GraspKind.TOP)
    choice = choose_grasp(context, bottle, HANDS, GraspKind.SIDE, [])
    assert choice.out is not None
    assert choice.out[0, 3] < 0.42
    assert choice.lift_m < 0.8 - TABLE_M - 2 * HALF_M


def test_what_carries_something_is_taken_from_the_side_first_and_a_book_never(
    context: SkillContext, standing: "StandingLink"
) -> None:
    bottle = seen(standing, (0.5, 0.1))
    standing.objects = [bottle, {**seen(standing, (0.5, 0.1)), "rests": {"of": bottle["id"]}}]
    assert kinds_for(context, bottle)[0] is GraspKind.SIDE
    book = seen(standing, (0.5, 0.1), kind="book", size_m=(0.16, 0.07, 0.2))
    assert kinds_for(context, book) == (GraspKind.TOP,)
    assert kinds_for(context, None) == (GraspKind.TOP,)
    with pytest.raises(NotPossible, match="not round"):
        choose_grasp(context, book, HANDS, GraspKind.SIDE, [])
