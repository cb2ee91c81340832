from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from vla_deploy.world import Thing
from vla_deploy.world.resting import LET_GO, rest_of
from vla_deploy.world.thing import Rest, Surface

Make = Callable[..., Thing]
TABLE = Surface(
    name="coffee_table", height_m=0.45, polygon_m=((0.0, -1.0), (2.0, -1.0), (2.0, 1.0), (0.0, 1.0))
)
ON_TABLE = Rest("on", "coffee_table")


def test_a_cup_on_the_table_a_ball_on_the_floor_and_one_in_the_air(thing: Make) -> None:
    assert rest_of(thing("cup", 1.0, 0.0), [], [TABLE]) == ON_TABLE
    assert rest_of(thing("ball", 1.0, 0.0, 0.0), [], [TABLE]) == Rest("on", "floor")
    assert rest_of(thing("cup", 1.0, 0.0, 0.8), [], [TABLE]) is None
    assert rest_of(thing("cup", 2.1, 0.0), [], [TABLE]) is None


def test_a_cup_in_the_box_is_in_it_and_the_box_on_the_table(thing: Make) -> None:
    box, cup = thing("box", 1.0, 0.0), thing("cup", 1.05, 0.02, 0.46)
    assert rest_of(cup, [box, cup], [TABLE]) == Rest("in", "box_1")
    assert rest_of(box, [box, cup], [TABLE]) == ON_TABLE


@pytest.mark.parametrize(
    ("x_m", "on_m", "why"),
    [(1.2, 0.45, "beside the box"), (1.0, 0.60, "above its rim"), (1.0, 0.2, "under it")],
)
def test_what_is_not_in_the_box(thing: Make, x_m: float, on_m: float, why: str) -> None:
    box, cup = thing("box", 1.0, 0.0), thing("cup", x_m, 0.0, on_m)
    assert rest_of(cup, [box, cup], [TABLE]) != Rest("in", "box_1"), why


def test_a_ball_on_a_book_is_on_the_book(thing: Make) -> None:
    book, ball = thing("book", 1.0, 0.0), thing("ball", 1.02, 0.0, 0.49)
    assert rest_of(ball, [book, ball], [TABLE]) == Rest("on", "book_1")


def test_no_box_is_in_a_box_and_nothing_in_what_a_hand_holds(thing: Make) -> None:
    boxes = [thing("box_1", 1.0, 0.0), thing("box_2", 1.02, 0.0, 0.46, size_m=(0.2, 0.2, 0.1))]
    assert rest_of(boxes[1], boxes, [TABLE]) == ON_TABLE
    box, cup = thing("box", 1.0, 0.0, held_by="left"), thing("cup", 1.0, 0.0)
    assert rest_of(cup, [box, cup], [TABLE]) == ON_TABLE


def test_noise_at_a_bound_switches_nothing(thing: Make) -> None:
    """At the rim, where one image says in and the next one on, the first answer stays."""
    random = np.random.default_rng(0)
    box = thing("box", 1.0, 0.0)
    cup = thing("cup", 1.112, 0.0, 0.46, rests=Rest("in", "box_1"))
    answers, bare = set(), set()
    for _ in range(200):
        dx, dz = random.normal(0.0, 0.006, 2)
        x_m, y_m, z_m = cup.position_m
        seen = replace(cup, position_m=(x_m + dx, y_m, z_m + dz))
        cup = replace(cup, rests=rest_of(seen, [box], [TABLE]))
        answers.add(cup.rests)
        bare.add(rest_of(replace(seen, rests=None), [box], [TABLE]))
    assert answers == {Rest("in", "box_1")}
    assert len(bare) > 1, "without memory the same noise does switch it"


def test_two_tables_of_nearly_one_height_do_not_swap_a_thing(thing: Make) -> None:
    lower = replace(TABLE, name="shelf", height_m=0.43)
    cup = thing("cup", 1.0, 0.0, 0.435, rests=Rest("on", "shelf"))
    assert rest_of(cup, [], [TABLE, lower]) == Rest("on", "shelf")
    assert rest_of(replace(cup, rests=None), [], [TABLE, lower]) == ON_TABLE


def test_where_a_hand_let_go_the_height_is_less_sure(thing: Make) -> None:
    cup = thing("cup", 1.0, 0.0, 0.51)
    assert rest_of(cup, [], [TABLE]) is None
    assert rest_of(cup, [], [TABLE], LET_GO) == ON_TABLE
