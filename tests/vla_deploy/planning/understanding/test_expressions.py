import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.understanding.expression import Expression, Scope
from vla_deploy.planning.understanding.expressions import read_expression

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
    ("text", "side", "by_speaker"),
    [
        ("the left cup", "left", False),
        ("the one on my left", "left", True),
        ("the cup to the left of the box", "", False),
    ],
)
def test_a_side_is_told_from_a_relation(text: str, side: str, by_speaker: bool) -> None:
    assert (read(text).side, read(text).by_speaker) == (side, by_speaker)


def test_other_and_extremes_are_taken_out_of_the_query() -> None:
    assert (read("the other one").is_other, str(read("the other one").query)) == (True, "object")
    assert (read("the biggest ball").extreme, str(read("the biggest ball").query)) == (
        "big",
        "ball",
    )


def test_a_generic_word_for_furniture_means_all_that_are_called_so() -> None:
    assert read("the cup on the table").support == {"coffee_table", "kitchen_table"}
    assert str(read("the cup on the table").query) == "cup"


def test_what_only_sounds_alike_is_a_doubt_and_what_is_misspelt_a_correction() -> None:
    assert [one.known for one in read("the cap").doubts] == [("cup",)]
    assert [one.known for one in read("the botle").corrections] == [("bottle",)]


@pytest.mark.parametrize("text", ["the dinosaur", "the moon", "", "the red blue cup", "the cat"])
def test_what_is_like_nothing_known_is_refused(text: str) -> None:
    with pytest.raises(UnknownObject):
        read(text)


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        assert read(text).said is not None
    except UnknownObject as error:
        assert "I do not know" in str(error)
