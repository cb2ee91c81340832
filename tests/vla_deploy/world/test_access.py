from collections.abc import Callable

import pytest

from vla_deploy.robots import load_robot
from vla_deploy.world import Body, Snapshot, Thing, Viewpoint, access_to
from vla_deploy.world.access import Bar, GraspStand
from vla_deploy.world.thing import Rest

Make, MakeWorld = Callable[..., Thing], Callable[..., Snapshot]
REACH = load_robot("butler").reach
BODY = Body(
    opening_max_m=0.088, hands=("left", "right"), reach=REACH, is_free=lambda x_m, y_m: True
)


def bars(one: Thing, snapshot: Snapshot, body: Body = BODY) -> list[tuple[Bar, str]]:
    return [(found.bar, found.by) for found in access_to(one, snapshot, body).obstacles]


def test_a_cup_before_the_robot_can_be_taken_from_here(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 0.45, 0.1)
    found = access_to(cup, world(cup), BODY)
    assert (found.way, found.is_graspable, found.is_accessible) == (GraspStand.HERE, True, True)


@pytest.mark.parametrize(("x_m", "y_m"), [(0.7, 0.0), (0.45, 0.3), (0.2, 0.0), (-0.45, 0.0)])
def test_elsewhere_it_takes_a_drive(thing: Make, world: MakeWorld, x_m: float, y_m: float) -> None:
    cup = thing("cup", x_m, y_m)
    assert access_to(cup, world(cup), BODY).way is GraspStand.AFTER_DRIVING


def test_where_nobody_can_stand_it_says_so(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 2.0, 0.0)
    walled = Body(opening_max_m=0.088, hands=("left",), reach=REACH, is_free=lambda x_m, y_m: False)
    found = access_to(cup, world(cup), walled)
    assert (found.way, bars(cup, world(cup), walled)) == (GraspStand.NONE, [(Bar.NO_STAND, "")])


def test_a_book_under_a_ball_is_blocked_by_it(thing: Make, world: MakeWorld) -> None:
    book = thing("book", 0.45, 0.0, size_m=(0.2, 0.07, 0.04))
    ball = thing("ball", 0.45, 0.0, 0.49, rests=Rest("on", "book_1"))
    assert bars(book, world(book, ball)) == [(Bar.ON_TOP, "ball_1")]
    assert bars(ball, world(book, ball)) == []


def test_a_box_is_too_wide(thing: Make, world: MakeWorld) -> None:
    box = thing("box", 0.45, 0.0)
    found = access_to(box, world(box), BODY)
    assert (found.is_graspable, found.obstacles[0].bar) == (False, Bar.TOO_WIDE)
    assert "240 mm" in found.obstacles[0].why


@pytest.mark.parametrize(("on_m", "bar"), [(0.0, Bar.TOO_LOW), (0.9, Bar.TOO_HIGH)])
def test_floor_and_wardrobe_are_out_of_a_downward_hands_reach(
    thing: Make, world: MakeWorld, on_m: float, bar: Bar
) -> None:
    cup = thing("cup", 0.45, 0.0, on_m)
    assert bars(cup, world(cup)) == [(bar, "")]


def test_one_neighbour_leaves_a_round_thing_other_ways_to_be_taken(
    thing: Make, world: MakeWorld
) -> None:
    cup, bottle = thing("cup", 0.45, 0.0), thing("bottle", 0.45, 0.08)
    assert bars(cup, world(cup, bottle)) == []


def test_a_flat_thing_with_something_at_its_side_is_blocked_by_that(
    thing: Make, world: MakeWorld
) -> None:
    """A phone has one way to be taken: across its narrow side, where the cup stands."""
    phone = thing("phone", 0.45, 0.0, size_m=(0.15, 0.07, 0.012))
    cup = thing("cup", 0.45, 0.08)
    assert bars(phone, world(phone, cup)) == [(Bar.BESIDE, "cup_1")]
    assert bars(phone, world(phone, thing("cup", 0.60, 0.0))) == []


def test_a_cup_hemmed_in_names_who_hems_it(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 0.45, 0.0)
    ring = [
        thing(f"bottle_{number}", 0.45 + 0.07 * dx, 0.07 * dy)
        for number, (dx, dy) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1), (0.7, 0.7),
                                           (-0.7, 0.7), (0.7, -0.7), (-0.7, -0.7)))
    ]  # fmt: skip
    found = bars(cup, world(cup, *ring))
    assert found
    assert {bar for bar, _ in found} == {Bar.BESIDE}


def test_in_a_box_the_middle_can_be_reached_and_the_corner_cannot(
    thing: Make, world: MakeWorld
) -> None:
    box = thing("box", 0.45, 0.0)
    inside = Rest("in", "box_1")
    middle = thing("cup", 0.45, 0.0, 0.46, rests=inside)
    corner = thing("ball", 0.36, 0.09, 0.46, rests=inside)
    assert bars(middle, world(box, middle)) == []
    assert bars(corner, world(box, corner)) == [(Bar.CLOSED_IN, "box_1")]


def test_a_small_ball_in_a_narrow_deep_box_is_too_deep(thing: Make, world: MakeWorld) -> None:
    box = thing("box", 0.45, 0.0, size_m=(0.1, 0.1, 0.3))
    ball = thing("ball", 0.45, 0.0, 0.46, rests=Rest("in", "box_1"))
    assert bars(ball, world(box, ball)) == [(Bar.CLOSED_IN, "box_1")]


def test_hands_that_are_full_or_hold_it_already(thing: Make, world: MakeWorld) -> None:
    cup, ball = thing("cup", 0.3, 0.1, held_by="left"), thing("ball", 0.3, -0.1, held_by="right")
    book = thing("book", 0.45, 0.0, size_m=(0.2, 0.07, 0.04))
    assert bars(cup, world(cup, ball, book)) == [(Bar.HELD, "")]
    assert bars(book, world(cup, ball, book)) == [(Bar.HANDS_FULL, "")]
    assert bars(book, world(cup, book)) == []


def test_a_place_that_is_a_guess_must_be_looked_at_first(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 0.45, 0.0, sigma_m=(0.25, 0.25, 0.25))
    assert bars(cup, world(cup)) == [(Bar.UNSURE, "")]


def test_without_a_pose_or_a_map_it_still_judges_the_grasp(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 0.45, 0.0)
    blind = Body(opening_max_m=0.088, hands=("left",), reach=REACH)
    assert access_to(cup, world(cup, robot=None), blind).way is GraspStand.AFTER_DRIVING
    seen = world(cup, robot=Viewpoint(x_m=0.0, y_m=0.0))
    assert access_to(cup, seen, blind).way is GraspStand.HERE
