"""Descriptions that only the things around tell apart: rows, extremes, what it is not."""

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from vla_deploy.planning.errors import Ambiguous, NotAble, UnknownObject
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.resolver import Resolver
from vla_deploy.world import Thing
from vla_deploy.world.thing import Rest

if TYPE_CHECKING:
    from conftest import Home


def _thing(name: str, colour: str, x_m: float, y_m: float = 1.5, **changes: object) -> Thing:
    size_m = (0.06, 0.06, 0.15)
    fields = {
        "thing_id": name,
        "kind": name.partition("_")[0],
        "colour": colour,
        "position_m": (x_m, y_m, 0.525),
        "size_m": size_m,
        "rests": Rest("on", "coffee_table"),
    }
    return Thing(**(fields | changes))  # type: ignore[arg-type]


# The robot looks down the y axis: what has the larger x stands farther to the left.
BOTTLES = (
    _thing("bottle_1", "green", 1.7),
    _thing("bottle_2", "white", 2.1, 1.2, size_m=(0.08, 0.08, 0.25)),
    _thing("bottle_3", "green", 2.6),
)
ELSEWHERE = _thing("bottle_4", "pink", -1.8, 4.5, rests=Rest("on", "kitchen_table"))
BALL = _thing("ball_1", "pink", 2.4, size_m=(0.06, 0.06, 0.06))
CAN = _thing("can_1", "pink", 2.0, 1.6, size_m=(0.065, 0.065, 0.12))


@pytest.fixture
def scene(home: "Home") -> Request:
    """Return three bottles in a row, one in the kitchen, a ball, a can and a box."""
    return home.ask(*BOTTLES, ELSEWHERE, BALL, CAN, "box_1")


def names(request: Request, text: str, use: Use = Use.TAKE) -> list[str]:
    return [one.name for one in Resolver(request).things(text, use)]


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        # --- rows
        ("the last bottle on the left", "bottle_3"),
        ("the second of the bottles from the right", "bottle_2"),
        ("the second green bottle from the left", "bottle_1"),
        # --- extremes
        ("the bottle that is farthest away", "bottle_4"),
        ("the tallest bottle", "bottle_2"),
        ("the bigger of the two balls", "ball_1"),
        ("the widest one of the bottles", "bottle_2"),
        ("the bottle closest to the ball", "bottle_3"),
        # --- what it is not
        ("anything but the pink ones or the green ones", "bottle_2"),
        ("the bottle on the far left", "bottle_3"),
        ("any bottle but the nearest", "bottle_3"),
        ("the non-pink bottle on the kitchen table", None),
        # --- where it is
        ("that ball on the table there", "ball_1"),
    ],
)
def test_it_is_told_from_the_things_around(scene: Request, text: str, meant: str | None) -> None:
    if meant is None:
        with pytest.raises((NotAble, UnknownObject)):
            names(scene, text)
    else:
        assert names(scene, text) == [meant]


def test_all_but_one_are_all_the_others(scene: Request) -> None:
    assert names(scene, "all bottles except the white one") == ["bottle_1", "bottle_3", "bottle_4"]


@pytest.mark.parametrize(
    ("text", "question"),
    [
        ("the third bottle", "Which bottle, "),  # from where?
        ("the fourth bottle from the left", "Which bottle, "),  # three stand here, one elsewhere
        ("the bottle that isn't white", "Which bottle, "),
        ("the wider of the two bottles", "Which bottle, "),  # there are four
        ("the highest of the cups", "Which cup, "),
        ("the second nearest bottle", "Which bottle, "),
    ],
)
def test_what_still_means_several_is_asked(home: "Home", text: str, question: str) -> None:
    scene = home.ask(*BOTTLES, ELSEWHERE, CAN, "cup_1", "cup_2")
    with pytest.raises(Ambiguous) as asked:
        names(scene, text)
    assert asked.value.question.startswith(question)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("the fifth bottle from the left", 'nothing that is "fifth bottle from left"'),
        ("the can that isn't pink", 'nothing that is "can is not pink", only the pink can'),
        ("the first book from the left", "I see no book"),
        ("any cup but the blue one", "I see no cup"),
        ("the bottle nearest to the bowl", 'nothing that is "bottle nearest to bowl"'),
    ],
)
def test_what_is_not_there_is_said_to_be_not(scene: Request, text: str, says: str) -> None:
    with pytest.raises(NotAble, match=says):
        names(scene, text)


@pytest.mark.parametrize(
    "text",
    [
        "the round box",
        "the second dinosaur from the left",
        "any bottle but the broken one",
        "the bottle with the green cap",
        "the bottle nearest to the window",
        "first the white bottle",
        "the bottle that is neither",
        "all bottles except them",
    ],
)
def test_what_the_robot_cannot_tell_is_refused(scene: Request, text: str) -> None:
    with pytest.raises(UnknownObject):
        names(scene, text)


def test_what_may_not_be_taken_is_counted_and_then_not_taken(home: "Home") -> None:
    box = replace(home.things["box_1"], position_m=(2.9, 1.5, 0.5), rests=BALL.rests)
    scene = home.ask(box, *BOTTLES)
    assert names(scene, "the first thing from the left", Use.SEE) == ["box_1"]
    assert names(scene, "the second thing from the left") == ["bottle_3"]
    with pytest.raises(NotAble):
        names(scene, "the first thing from the left")


def test_a_thing_in_the_hand_stands_in_no_row(home: "Home") -> None:
    held = replace(BOTTLES[2], held_by="left")
    assert names(home.ask(*BOTTLES[:2], held), "the first bottle from the left") == ["bottle_2"]


@pytest.mark.parametrize("text", ["the second one", "the last"])
def test_a_place_in_no_row_is_asked(home: "Home", text: str) -> None:
    with pytest.raises(Ambiguous):
        names(home.ask("cup_1", "cup_2", conversation=home.spoke_of("cup_1")), text)


@pytest.mark.parametrize("text", ["the big one", "the bigger one", "the larger one please"])
def test_the_big_one_after_a_mention_is_of_that_kind(home: "Home", text: str) -> None:
    large = replace(BALL, thing_id="ball_2", colour="red", size_m=(0.09, 0.09, 0.09))
    scene = home.ask(
        large, "ball_1", "cup_1", *BOTTLES, "box_1", conversation=home.spoke_of("ball_1")
    )
    assert names(scene, text) == ["ball_2"]


def test_the_big_one_is_of_the_kind_spoken_of_that_can_be_taken(home: "Home") -> None:
    large = replace(BALL, thing_id="ball_2", colour="red", size_m=(0.09, 0.09, 0.09))
    resolver = Resolver(home.ask(BALL, large, "box_1"))
    resolver.thing("the small ball", Use.PUT)
    resolver.thing("the box", Use.ONTO)
    assert resolver.thing("the big one", Use.PUT).name == "ball_2"


def test_what_was_spoken_of_settles_no_place_in_a_row(home: "Home") -> None:
    scene = home.ask("cup_1", "cup_2", "cup_4", conversation=home.spoke_of("cup_1"))
    with pytest.raises(Ambiguous):
        names(scene, "the second cup")


def test_one_of_several_is_not_one_of_many(scene: Request) -> None:
    with pytest.raises(Ambiguous):
        names(scene, "the smaller of the two bottles")


def test_the_log_tells_among_which_things_it_was_told(scene: Request) -> None:
    resolver = Resolver(scene)
    resolver.thing("the second bottle from the left", Use.TAKE)
    assert resolver.reasons == [
        '"second bottle from left" is bottle_2 (white bottle) (the only one of 4 that fits)'
    ]
