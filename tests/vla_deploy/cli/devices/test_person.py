"""`vla-deploy person` against a socket that answers as the twin does."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Person = Callable[..., Any]
WORLD = {
    "ok": True,
    "things": {"red_cup": [2.0, 1.6, 0.5], "book": [2.4, 1.55, 0.46]},
    "held_by_robot": ["red_cup"],
    "taken": [],
    "pulls_at": None,
    "told": "",
}


@pytest.fixture
def person(vla: Person) -> Person:
    return lambda *words: vla("person", *words)


TOLD = "the robot did not let go of the book within 5 s"


@pytest.fixture
def asked(run_dir: Path, serve_twin: Callable[..., Any]) -> list[dict[str, Any]]:
    """Serve a twin, and keep what it is asked; a pull has ended at the second question about it."""
    asked: list[dict[str, Any]] = []

    def answer(request: dict[str, Any]) -> dict[str, Any]:
        asked.append(request)
        thing = asked[0].get("object")
        if len(asked) < 3:
            return {**WORLD, "pulls_at": thing}
        return {**WORLD, "told": TOLD} if thing == "book" else {**WORLD, "taken": [thing]}

    serve_twin(run_dir, answer)
    return asked


def test_the_things_are_listed_with_who_has_them(
    person: Person, asked: list[dict[str, Any]]
) -> None:
    said = person("list")
    assert (said.code, asked) == (0, [{"op": "things"}])
    assert said.out.splitlines() == [
        "red_cup            2.000   1.600   0.500 held",
        "book               2.400   1.550   0.460",
    ]


def test_a_thing_is_taken_as_soon_as_the_pull_has_ended(
    person: Person, asked: list[dict[str, Any]]
) -> None:
    said = person("take", "red_cup")
    assert (said.code, said.out) == (0, "took red_cup\n")
    assert [one["op"] for one in asked] == ["take", "things", "things"]


def test_a_robot_that_holds_on_is_told(person: Person, asked: list[dict[str, Any]]) -> None:
    said = person("take", "book")
    assert (said.code, said.out) == (1, "")
    assert said.err == f"vla-deploy: {TOLD}\n"
    assert len(asked) == 3


def test_a_thing_is_put_where_it_is_told_to_be(person: Person, asked: list[dict[str, Any]]) -> None:
    said = person("put", "red_cup", "2.2", "1.6", "0.4975", "--yaw", "0.5")
    assert (said.code, said.out) == (0, "put red_cup down\n")
    place = {"x_m": 2.2, "y_m": 1.6, "z_m": 0.4975, "yaw_rad": 0.5}
    assert asked == [{"op": "put", "object": "red_cup", **place}]
