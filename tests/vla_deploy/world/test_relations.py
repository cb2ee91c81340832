from collections.abc import Callable

import pytest

from vla_deploy.world import Snapshot, Thing, Viewpoint, relations_of
from vla_deploy.world.relations import RELATIONS, is_near, is_under
from vla_deploy.world.thing import Rest, Surface

Make, MakeWorld = Callable[..., Thing], Callable[..., Snapshot]
ORIGIN = Viewpoint(x_m=0.0, y_m=0.0)
TABLE = Surface(
    name="table", height_m=0.45, polygon_m=((0.0, -1.0), (2.0, -1.0), (2.0, 1.0), (0.0, 1.0))
)


def words(one: Thing, other: Thing, view: Viewpoint | None = ORIGIN) -> set[str]:
    return {word for word, holds in RELATIONS.items() if holds(one, other, view)}


@pytest.mark.parametrize(
    ("x_m", "y_m", "expected"),
    [
        (1.0, 0.4, {"left of"}),
        (1.0, -0.4, {"right of"}),
        (1.4, 0.0, {"behind"}),
        (0.6, 0.0, {"in front of"}),
        (1.35, 0.45, {"behind", "left of"}),
        (1.02, 0.0, set()),
        (1.9, 0.9, set()),
    ],
)
def test_left_right_before_and_behind_as_the_robot_sees_them(
    thing: Make, x_m: float, y_m: float, expected: set[str]
) -> None:
    ball, bottle = thing("ball", x_m, y_m), thing("bottle", 1.0, 0.0)
    assert words(ball, bottle) - {"next to"} == expected


def test_they_turn_round_for_who_looks_from_the_other_side(thing: Make) -> None:
    ball, bottle = thing("ball", 1.0, 0.3), thing("bottle", 1.0, 0.0)
    assert "left of" in words(ball, bottle)
    assert "right of" in words(ball, bottle, Viewpoint(x_m=2.0, y_m=0.0, yaw_rad=3.14))
    assert words(ball, bottle, None) == set()


def test_which_way_the_robot_faces_does_not_matter(thing: Make) -> None:
    ball, bottle = thing("ball", 1.0, 0.3), thing("bottle", 1.0, 0.0)
    turned = Viewpoint(x_m=0.0, y_m=0.0, yaw_rad=2.0)
    assert words(ball, bottle, turned) == words(ball, bottle)


def test_opposites_hold_the_other_way_round(thing: Make) -> None:
    opposites = {"left of": "right of", "in front of": "behind", "next to": "next to"}
    opposites |= {value: key for key, value in opposites.items()}
    for x_m, y_m in ((1.1, 0.05), (0.9, 0.2), (1.3, -0.3)):
        one, other = thing("ball", x_m, y_m), thing("bottle", 1.0, 0.0)
        assert {opposites[word] for word in words(one, other)} == words(other, one)


def test_next_to_is_by_the_gap_on_one_level(thing: Make) -> None:
    bottle = thing("bottle", 1.0, 0.0)
    assert "next to" in words(thing("ball", 1.0, 0.2), bottle)
    assert "next to" not in words(thing("ball", 1.0, 0.3), bottle)
    assert "next to" not in words(thing("ball", 1.0, 0.2, 0.0), bottle)
    assert "next to" not in words(thing("ball", 1.0, 0.2, held_by="left"), bottle)
    assert is_near(thing("ball", 1.0, 0.3), bottle)


def test_what_is_in_or_on_a_thing_is_not_beside_it(thing: Make) -> None:
    box = thing("box", 1.0, 0.0)
    cup = thing("cup", 1.05, 0.0, 0.46, rests=Rest("in", "box_1"))
    book = thing("book", 1.0, 0.5)
    ball = thing("ball", 1.0, 0.5, 0.49, rests=Rest("on", "book_1"))
    assert words(cup, box) == {"in"}
    assert words(box, cup) == set()
    assert words(ball, book) == {"on"}
    assert words(book, ball) == {"under"}


def test_a_ball_under_the_table(thing: Make) -> None:
    assert is_under(thing("ball", 1.0, 0.0, 0.0), TABLE)
    assert not is_under(thing("ball", 3.0, 0.0, 0.0), TABLE)
    assert not is_under(thing("ball", 1.0, 0.0), TABLE)


def test_all_relations_of_a_scene(thing: Make, world: MakeWorld) -> None:
    cup = thing("cup", 1.0, 0.0, rests=Rest("on", "table"))
    ball = thing("ball", 1.0, 0.15, rests=Rest("on", "table"))
    told = {
        f"{one.subject} {one.relation} {one.other}"
        for one in relations_of(world(cup, ball, surfaces=(TABLE,)))
    }
    assert told == {
        "cup_1 on table", "ball_1 on table", "ball_1 next to cup_1", "cup_1 next to ball_1",
        "ball_1 left of cup_1", "cup_1 right of ball_1",
    }  # fmt: skip
