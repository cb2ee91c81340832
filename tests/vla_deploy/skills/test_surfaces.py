import math
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.skills.context import SkillContext
from vla_deploy.skills.movements.surfaces import EDGE_M, free_spots, spots_beside
from vla_deploy.world.document import read_thing
from vla_deploy.world.relations import is_next_to

if TYPE_CHECKING:
    from conftest import StandingLink

TABLE_M = [[1.35, 1.5], [1.95, 1.5], [1.95, 2.5], [1.35, 2.5]]


def test_spots_lie_on_the_surface_away_from_its_edge(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    spots = free_spots(context, "left")
    assert spots
    for x_m, y_m, height_m in spots:
        assert height_m == 0.45
        assert standing.pose.outward(x_m, y_m)[0] >= 1.35 + EDGE_M


def test_a_hand_begins_on_its_own_side(context: SkillContext, standing: "StandingLink") -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    assert free_spots(context, "left")[0][1] > 0.0
    assert free_spots(context, "right")[0][1] < 0.0


def thing(kind: str, size_m: float, **more: Any) -> dict[str, Any]:
    place = {"position_m": [1.44, 2.10, 0.5], "size_m": [size_m, size_m, 0.1]}
    return {"id": f"{kind}_1", "class": kind, "colour": "", **place, **more}


@pytest.mark.parametrize(("kind", "size_m"), [("cup", 0.08), ("box", 0.23)])
def test_spots_keep_apart_from_the_outlines_of_things(
    context: SkillContext, standing: "StandingLink", kind: str, size_m: float
) -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    standing.objects = [thing(kind, size_m)]
    spots = free_spots(context, "left")
    assert spots
    for x_m, y_m, _ in spots:
        spot = standing.pose.outward(x_m, y_m)
        assert math.dist(spot, (1.44, 2.10)) > size_m / 2 + context.robot.reach.apart_m


def test_what_a_hand_holds_takes_no_room(context: SkillContext, standing: "StandingLink") -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    free = free_spots(context, "left")
    standing.objects = [thing("cup", 0.08, held_by="left")]
    assert free_spots(context, "left") == free


def test_the_floor_and_high_shelves_are_no_place_to_put_things(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.surfaces = [
        {"height_m": height_m, "polygon_m": TABLE_M} for height_m in (0.0, 0.15, 0.9)
    ]
    assert free_spots(context, "left") == []


@pytest.mark.parametrize(("kind", "size_m"), [("cup", 0.08), ("box", 0.23)])
def test_what_is_put_beside_a_thing_stands_next_to_it(
    context: SkillContext, standing: "StandingLink", kind: str, size_m: float
) -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    standing.objects = [thing(kind, size_m)]
    anchor = read_thing(standing.objects[0])

    spots = spots_beside(context, "left", standing.objects[0])

    assert len(spots) >= 8
    for x_m, y_m, height_m in spots:
        spot = [*standing.pose.outward(x_m, y_m), height_m + 0.05]
        put = read_thing({**thing("can", 0.06), "id": "can_1", "position_m": spot})
        assert is_next_to(put, anchor)


def test_beside_means_on_the_same_surface_and_apart_from_others(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.objects = [thing("cup", 0.08)]
    standing.surfaces = [{"height_m": 0.60, "polygon_m": TABLE_M}]
    assert spots_beside(context, "left", standing.objects[0]) == []
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    other = {**thing("can", 0.08), "position_m": [1.44, 2.28, 0.5]}
    standing.objects.append(other)
    for x_m, y_m, _ in spots_beside(context, "left", standing.objects[0]):
        spot = standing.pose.outward(x_m, y_m)
        assert math.dist(spot, (1.44, 2.28)) > 0.04 + context.robot.reach.apart_m


def test_a_hand_begins_beside_a_thing_where_it_reaches_best(
    context: SkillContext, standing: "StandingLink"
) -> None:
    standing.surfaces = [{"height_m": 0.45, "polygon_m": TABLE_M}]
    standing.objects = [thing("cup", 0.08)]
    left, right = (
        spots_beside(context, hand, standing.objects[0])[0] for hand in ("left", "right")
    )
    assert left[1] > right[1]
