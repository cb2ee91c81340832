import math
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.manipulation.grasps import Grasp, grasps_from_above, grasps_from_side
from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.neighbours import crowding_m

if TYPE_CHECKING:
    from conftest import StandingLink

BALL_M = (0.45, 0.10, 0.475)
BALL_SIZE_M = (0.066, 0.066, 0.066)
CUP_SIZE_M = (0.08, 0.08, 0.10)


def thing(
    standing: "StandingLink", at_m: tuple[float, float, float], kind: str, size_m: Any
) -> dict[str, Any]:
    position = (*standing.pose.outward(at_m[0], at_m[1]), at_m[2])
    return {"id": kind, "class": kind, "position_m": position, "size_m": list(size_m)}


def grasps() -> list[Grasp]:
    return grasps_from_above("ball", BALL_M, BALL_SIZE_M, 0.0, 0.088)


def crowdings(
    context: SkillContext, standing: "StandingLink", cup_m: tuple[float, float, float], kind: str
) -> list[float]:
    ball = thing(standing, BALL_M, "ball", BALL_SIZE_M)
    standing.objects = [ball, thing(standing, cup_m, kind, CUP_SIZE_M)]
    return [crowding_m(context, grasp, ball) for grasp in grasps()]


@pytest.mark.parametrize("bearing_rad", [0.0, 0.7, math.pi / 2, 2.4, -1.2])
def test_fingers_find_room_beside_a_near_neighbour_but_not_towards_it(
    context: SkillContext, standing: "StandingLink", bearing_rad: float
) -> None:
    dx_m, dy_m = 0.1 * math.cos(bearing_rad), 0.1 * math.sin(bearing_rad)
    cup_m = (BALL_M[0] + dx_m, BALL_M[1] + dy_m, 0.49)
    found = crowdings(context, standing, cup_m, "cup")
    least = grasps()[found.index(min(found))]
    most = grasps()[found.index(max(found))]
    # The fingers stand on the hand's y axis; this is how far it points away from the cup.
    off = [
        abs(math.sin(one.yaw_rad) * dx_m - math.cos(one.yaw_rad) * dy_m) for one in (least, most)
    ]
    assert min(found) == 0.0
    assert max(found) > 0.02
    assert off[0] < off[1]


@pytest.mark.parametrize(
    ("cup_m", "kind"),
    [
        pytest.param((0.75, 0.10, 0.49), "cup", id="far"),
        pytest.param((0.55, 0.10, 0.30), "cup", id="lower than the finger tips"),
        pytest.param((0.55, 0.10, 0.49), "object", id="not recognised"),
    ],
)
def test_other_things_leave_all_the_room(
    context: SkillContext,
    standing: "StandingLink",
    cup_m: tuple[float, float, float],
    kind: str,
) -> None:
    assert max(crowdings(context, standing, cup_m, kind)) == 0.0


BOTTLE_M, BOTTLE_SIZE_M = (0.45, 0.10, 0.59), (0.056, 0.056, 0.18)


@pytest.mark.parametrize(
    ("at_m", "size_m", "tilt_rad", "bars"),
    [
        pytest.param((0.30, 0.10, 0.55), CUP_SIZE_M, 1.571, True, id="on the way in"),
        pytest.param((0.45, 0.18, 0.55), CUP_SIZE_M, 1.571, True, id="beside the fingers"),
        pytest.param((0.45, 0.23, 0.55), CUP_SIZE_M, 1.571, False, id="clear of the fingers"),
        pytest.param((0.57, 0.10, 0.55), CUP_SIZE_M, 1.571, False, id="behind it"),
        pytest.param((0.30, 0.10, 0.52), (0.05, 0.05, 0.05), 1.571, False, id="under the hand"),
        pytest.param((0.30, 0.10, 0.80), CUP_SIZE_M, 1.571, False, id="on a shelf above"),
        pytest.param((0.30, 0.10, 0.55), CUP_SIZE_M, 0.785, False, id="under an inclined hand"),
    ],
)
def test_from_the_side_all_that_stands_in_the_way_of_the_hand_counts(
    context: SkillContext,
    standing: "StandingLink",
    at_m: tuple[float, float, float],
    size_m: tuple[float, float, float],
    tilt_rad: float,
    bars: bool,
) -> None:
    bottle = thing(standing, BOTTLE_M, "bottle", BOTTLE_SIZE_M)
    cup, unknown = (thing(standing, at_m, kind, size_m) for kind in ("cup", "object"))
    shoulder_m = (0.0, BOTTLE_M[1], 0.9)
    ahead = grasps_from_side("bottle", BOTTLE_M, BOTTLE_SIZE_M, shoulder_m, 0.088, tilt_rad)
    for other in (cup, unknown):
        standing.objects = [bottle, other]
        for grasp in ahead[:2]:
            assert (crowding_m(context, grasp, bottle) > 0.01) == bars
