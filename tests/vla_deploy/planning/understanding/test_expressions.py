import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.planning.errors import DependsOnView, UnknownObject
from vla_deploy.planning.understanding.expressions import (
    Expression,
    Scope,
    read_expression,
)

FURNITURE = {"coffee table": "coffee_table", "kitchen table": "kitchen_table"}


def read(text: str) -> Expression:
    return read_expression(text, FURNITURE)


@pytest.mark.parametrize(
    ("text", "pronoun"),
    [("it", "it"), ("that one", "it"), ("this", "it"), ("them", "them"), ("those", "them"),
     ("there", "there"), ("over here", "here"), ("the one", "it"), ("the same one", "it")],
)  # fmt: skip
def test_a_pronoun_is_told_from_a_description(text: str, pronoun: str) -> None:
    assert read(text).pronoun == pronoun


@pytest.mark.parametrize(
    ("text", "query"),
    [
        ("the red cup", "red cup"),
        ("the cell phone", "phone"),
        ("the cup that is on the coffee table", "cup on coffee table"),
        ("the cups", "cup"),
        ("everything", "object"),
        ("the orenge ball", "orange ball"),
        ("the botle", "bottle"),
        ("the nice plastic red water bottle", "red bottle"),
        ("the grey-coloured phone", "grey phone"),
        ("the box over by the ball", "box next to ball"),
        ("the bowl by the coffee table", "bowl on coffee table"),
        ("whatever's under the book", "object under book"),
        ("the black thing you have in your left hand", "black object"),
        ("that remote on the coffee table there", "remote on coffee table"),
        ("the keys from the coffee table", "keys on coffee table"),
    ],
)
def test_the_query_is_what_remains(text: str, query: str) -> None:
    assert str(read(text).query) == query


@pytest.mark.parametrize(
    ("text", "scope", "count"),
    [
        ("the cup", Scope.ONE, 0),
        ("any of the cups", Scope.ANY, 0),
        ("both cups", Scope.ALL, 2),
        ("two cups", Scope.ANY, 2),
        ("the two red cups", Scope.ALL, 2),
        ("the cup next to the books", Scope.ONE, 0),
    ],
)
def test_how_many_are_meant(text: str, scope: Scope, count: int) -> None:
    assert (read(text).scope, read(text).count) == (scope, count)


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ("the left cup", "left"),
        ("the one on the right", "right"),
        ("the cup furthest to the left", "left"),
        ("the cup in the middle", "middle"),
        ("the cup to the left of the box", ""),
    ],
)
def test_a_side_is_told_from_a_relation(text: str, side: str) -> None:
    assert read(text).side == side


@pytest.mark.parametrize("text", ["the one on my left", "the cup closest to me"])
def test_what_the_speaker_sees_is_not_taken_for_what_the_robot_sees(text: str) -> None:
    with pytest.raises(DependsOnView):
        read(text)


@pytest.mark.parametrize(
    ("text", "query", "nth", "side"),
    [
        ("the second mug from the left", "cup", 2, "left"),
        ("the first from the right remote", "remote", 1, "right"),
        ("the last can on the right", "can", 1, "right"),
        ("bottle number two", "bottle", 2, ""),
        ("the can on the left", "can", 0, "left"),
    ],
)
def test_a_place_in_a_row_is_told_from_the_thing(
    text: str, query: str, nth: int, side: str
) -> None:
    found = read(text)
    assert (str(found.query), found.nth, found.side) == (query, nth, side)


@pytest.mark.parametrize(
    ("text", "query", "besides"),
    [
        ("a bottle that is not green", "bottle", ["green object"]),
        ("the bottle that isn't green", "bottle", ["green object"]),
        ("all balls except for the pink or the white one", "ball",
         ["pink object", "white object"]),
        ("anything but the cup", "object", ["cup"]),
        ("everything else but the cup", "object", ["cup"]),
    ],
)  # fmt: skip
def test_what_it_is_not_is_told_from_the_thing(text: str, query: str, besides: list[str]) -> None:
    found = read(text)
    assert (str(found.query), [str(one.query) for one in found.besides]) == (query, besides)


def test_what_it_is_compared_with_is_told_from_the_thing() -> None:
    taller, nearest = read("the taller of the two bottles"), read("the can nearest to the bowl")
    assert (str(taller.query), taller.extreme, taller.among) == ("bottle", "tall", 2)
    assert nearest.near is not None
    assert (str(nearest.query), nearest.order, str(nearest.near.query)) == (
        "can",
        "nearest",
        "bowl",
    )


def test_other_and_extremes_are_taken_out_of_the_query() -> None:
    assert (read("the other one").is_other, str(read("the other one").query)) == (True, "object")
    assert (read("the biggest ball").extreme, str(read("the biggest ball").query)) == (
        "big",
        "ball",
    )


def test_a_generic_word_for_furniture_means_all_that_are_called_so() -> None:
    assert read("the cup on the table").support == {"coffee_table", "kitchen_table"}
    assert str(read("the cup on the table").query) == "cup"


def test_what_is_only_like_a_known_word_is_a_doubt() -> None:
    assert [one.known for one in read("the cap").doubts] == [("cup",)]


@pytest.mark.parametrize(
    "text",
    ["the dinosaur", "the moon", "", "the red blue cup", "the cat", "first the white bottle",
     "the bottle with the red lid", "the red one i mean the blue one", "the plastic one",
     "the cup that my sister gave me", "everything else", "one of those",
     "the can between the cup and the bowl"],
)  # fmt: skip
def test_what_is_like_nothing_known_is_refused(text: str) -> None:
    with pytest.raises(UnknownObject):
        read(text)


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        assert read(text).said is not None
    except UnknownObject as error:
        assert "I do not know" in str(error)
