from collections.abc import Callable

import pytest

from vla_deploy.world import Query, Snapshot, Thing, UnknownWord, Viewpoint, find, parse_query
from vla_deploy.world.thing import Rest

Make, MakeWorld = Callable[..., Thing], Callable[..., Snapshot]
FURNITURE = {"coffee table": "coffee_table", "kitchen table": "kitchen_table"}


@pytest.fixture
def room(thing: Make, world: MakeWorld) -> Snapshot:
    return world(
        thing("cup_1", 1.0, 0.0, rests=Rest("on", "coffee_table")),
        thing("cup_2", 1.0, 0.3, colour="blue", rests=Rest("on", "coffee_table")),
        thing("cup_3", 4.0, 0.0, rests=Rest("in", "box_1"), size_m=(0.09, 0.09, 0.13)),
        thing("book_1", 1.0, 0.45, colour="purple", aliases=("book_4",)),
        thing("box_1", 4.0, 0.0, colour="orange"),
        thing("bottle_1", 2.0, -0.5, colour="green"),
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("the cup", ["cup_1", "cup_2", "cup_3"]),
        ("red mug", ["cup_1", "cup_3"]),
        ("blue thing", ["cup_2"]),
        ("nearest cup", ["cup_1"]),
        ("farthest cup", ["cup_3"]),
        ("the big cup", ["cup_3"]),
        ("small red cup", ["cup_1"]),
        ("small bottle", ["bottle_1"]),
        ("tall thing", ["bottle_1"]),
        ("flat object", ["book_1"]),
        ("cup in the box", ["cup_3"]),
        ("cup on the coffee table", ["cup_1", "cup_2"]),
        ("cup on the kitchen table", []),
        ("red cup beside the blue cup", []),
        ("cup next to the book", ["cup_2"]),
        ("cup near the book", ["cup_1", "cup_2"]),
        ("cup to the right of the book", ["cup_1", "cup_2"]),
        ("cup_3", ["cup_3"]),
        ("book_4", ["book_1"]),
        ("ball", []),
    ],
)
def test_what_is_meant(room: Snapshot, text: str, expected: list[str]) -> None:
    query = parse_query(text, FURNITURE)
    assert [one.thing_id for one in find(query, room)] == expected


def test_who_looks_decides_what_is_nearest_and_what_is_left(room: Snapshot) -> None:
    beyond = Viewpoint(x_m=3.0, y_m=0.2)
    assert find(parse_query("nearest cup"), room, beyond)[0].thing_id == "cup_3"
    left = parse_query("cup left of the blue cup")
    assert [one.thing_id for one in find(left, room)] == []
    assert [one.thing_id for one in find(left, room, beyond)] == ["cup_1"]


@pytest.mark.parametrize(
    "text",
    ["red cup", "nearest small cup", "cup next to purple book", "cup_1", "cup on coffee table",
     "red ball in orange box on kitchen table"],
)  # fmt: skip
def test_a_query_reads_back_what_it_says(text: str) -> None:
    query = parse_query(text, FURNITURE)
    assert str(query) == text
    assert parse_query(str(query), FURNITURE) == query


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("the unicorn", "unicorn"),
        ("cup ball", "ball"),
        ("red blue cup", "blue"),
        ("cup next to the unicorn", "unicorn"),
        ("cup on", "on"),
        ("cup left of the coffee table", "left of"),
    ],
)
def test_what_it_does_not_know_it_says(text: str, word: str) -> None:
    with pytest.raises(UnknownWord) as refused:
        parse_query(text, FURNITURE)
    assert refused.value.word == word


def test_no_words_mean_everything(room: Snapshot) -> None:
    assert parse_query("") == Query()
    assert len(find(Query(), room)) == len(room.things)
