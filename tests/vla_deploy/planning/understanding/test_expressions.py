import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.planning.understanding.expressions import (
    Expression,
    Scope,
    read_expression,
)
from vla_deploy.plans.errors import DependsOnView, UnknownObject

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
        ("the nice plastic red water bottle", "red bottle"),
        ("the grey-coloured phone", "grey phone"),
        ("that remote over there", "remote"),
        ("his bottle", "bottle"),
        ("the nearest ball", "nearest ball"),
        ("the bigger ball", "big ball"),
        ("what is on the coffee table", "object on coffee table"),
        ("a glass of water", "cup"),
        ("the red cup in your left hand", "red cup"),
    ],
)
def test_the_query_is_what_remains(text: str, query: str) -> None:
    assert str(read(text).query) == query


@pytest.mark.parametrize(
    ("text", "scope", "count"),
    [
        ("the cup", Scope.ONE, 0),
        ("a cup", Scope.ANY, 0),
        ("any of the cups", Scope.ANY, 0),
        ("one of the cups", Scope.ANY, 0),
        ("another cup", Scope.ANY, 0),
        ("the cups", Scope.ALL, 0),
        ("those cups", Scope.ALL, 0),
        ("the red ones", Scope.ALL, 0),
        ("everything on the coffee table", Scope.ALL, 0),
        ("both cups", Scope.ALL, 2),
        ("the two red cups", Scope.ALL, 2),
        ("the cup next to the books", Scope.ONE, 0),
    ],
)
def test_how_many_are_meant(text: str, scope: Scope, count: int) -> None:
    assert (read(text).scope, read(text).count) == (scope, count)


@pytest.mark.parametrize(
    ("text", "query", "side"),
    [
        ("the left cup", "cup", "left"),
        ("the one on the right", "object", "right"),
        ("the cup on the right hand side", "cup", "right"),
        ("the cup in the middle", "cup", "middle"),
        ("the cup on the coffee table on your left", "cup on coffee table", "left"),
        ("the cup to the left of the box", "cup left of box", ""),
    ],
)
def test_a_side_is_told_from_a_relation(text: str, query: str, side: str) -> None:
    assert (str(read(text).query), read(text).side) == (query, side)


def test_what_the_speaker_sees_is_not_taken_for_what_the_robot_sees() -> None:
    with pytest.raises(DependsOnView):
        read("the one on my left")


@pytest.mark.parametrize(
    ("text", "hand"),
    [
        ("what you are holding", ""), ("everything you are holding", ""),
        ("what you have in your right hand", "right"), ("the one in your left hand", "left"),
    ],
)  # fmt: skip
def test_what_a_hand_holds_is_told_from_a_description(text: str, hand: str) -> None:
    assert (read(text).pronoun, {*read(text).held_by}) == (
        "held",
        {hand} if hand else {"left", "right"},
    )


@pytest.mark.parametrize(
    ("text", "query", "besides"),
    [
        ("a bottle that is not green", "bottle", ["green object"]),
        ("the bottle that isn't green", "bottle", ["green object"]),
        ("all balls except for the pink or the white one", "ball",
         ["pink object", "white object"]),
        ("everything but the cup", "object", ["cup"]),
    ],
)  # fmt: skip
def test_what_it_is_not_is_told_from_the_thing(text: str, query: str, besides: list[str]) -> None:
    found = read(text)
    assert (str(found.query), [str(one.query) for one in found.besides]) == (query, besides)


def test_other_is_taken_out_of_the_query() -> None:
    assert (read("the other one").is_other, str(read("the other one").query)) == (True, "object")
    assert read("all cups but it").is_other


def test_a_generic_word_for_furniture_means_all_that_are_called_so() -> None:
    assert read("the cup on the table").support == {"coffee_table", "kitchen_table"}
    assert str(read("the cup on the table").query) == "cup"


@pytest.mark.parametrize(
    "text",
    ["the dinosaur", "the moon", "", "the red blue cup", "the cat", "first the white bottle",
     "the bottle with the red lid", "the red one i mean the blue one", "the plastic one",
     "the cup that my sister gave me", "everything else", "one of those", "my glasses",
     "the can between the cup and the bowl", "the red cap", "the botle", "a little closer",
     # What is counted, or compared with another thing, is not told.
     "the second cup from the left", "the last one", "cup number two", "three cups",
     "a couple of cups", "one of the two cups", "the bigger of the two balls", "the tallest cup",
     "the cup nearest to the box", "the one nearest the book", "the cup closest to me",
     "the cup on the left table", "the cup next to the other cup", "all cups but the one you hold",
     "all but them", "all cups but one", "everything but", "all the cups over there"],
)  # fmt: skip
def test_what_is_not_known_is_refused(text: str) -> None:
    with pytest.raises(UnknownObject):
        read(text)


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        assert read(text).said is not None
    except UnknownObject as error:
        assert "I do not know" in str(error)
