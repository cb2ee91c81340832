"""`vla-deploy scene` on a scene that a perception process might have told."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.main import main, parser
from vla_deploy.cli.observation.scene import as_text, collect
from vla_deploy.cli.session import RobotSession
from vla_deploy.world import UnknownWord

if TYPE_CHECKING:
    from conftest import Robot

TABLE = {"relation": "on", "of": "coffee_table"}


def thing(name: str, x_m: float, y_m: float, height_m: float, **changes: Any) -> dict[str, Any]:
    return {
        "id": name,
        "class": name.partition("_")[0],
        "colour": "red",
        "position_m": [x_m, y_m, 0.45 + height_m / 2],
        "size_m": [0.066, 0.066, height_m],
        "last_seen_ns": 1_000_000_000,
        "sigma_m": [0.005, 0.005, 0.004],
        "rests": TABLE,
    } | changes


@pytest.fixture
def tell(robot: "Robot") -> Callable[..., None]:
    """Let perception tell a scene seen from the coffee table's viewpoint."""

    def tell(*objects: dict[str, Any], **changes: Any) -> None:
        document = {
            "stamp_ns": 1_000_000_000,
            "objects": list(objects),
            "surfaces": [],
            "robot": {"x_m": 2.2, "y_m": 2.05, "yaw_rad": -1.5708},
        }
        robot.space.cell_writer("scene").put_document(document | changes)
        robot.space.cell_writer("process_table").put_document({"robot": "butler"})

    return tell


def ask(session: RobotSession, *words: str) -> tuple[dict[str, Any], str]:
    arguments: argparse.Namespace = parser(["scene"]).parse_args(["scene", *words])
    told = collect(session, arguments)
    return told, as_text(told, arguments)


CUP, BOTTLE = thing("cup_1", 2.2, 1.6, 0.095), thing("bottle_1", 2.0, 1.6, 0.18)


def test_a_line_for_each_thing_with_place_and_whether_it_can_be_taken(
    session: RobotSession, tell: Callable[..., None]
) -> None:
    tell(CUP, thing("box_1", 2.5, 1.5, 0.13, size_m=[0.24, 0.24, 0.13]))
    told, text = ask(session)
    cup, box = text.splitlines()[1:]
    assert "red cup" in cup
    assert "coffee_table" in cup
    assert cup.endswith("here")
    assert box.endswith("no: too wide")
    assert told["things"][0]["distance"] == "near"


def test_relations_as_seen_from_here_and_from_the_other_side(
    session: RobotSession, tell: Callable[..., None]
) -> None:
    tell(CUP, BOTTLE)
    assert "bottle_1 right of cup_1" in ask(session, "--relations")[1]
    # From the place south of the table, were it one, left and right would be swapped.
    tell(CUP, BOTTLE, robot={"x_m": 2.1, "y_m": 0.5, "yaw_rad": 1.57})
    assert "bottle_1 left of cup_1" in ask(session, "--relations")[1]
    here, there = (ask(session, *words)[0]["view"] for words in ((), ("--from", "kitchen")))
    assert (here["name"], there["name"]) == ("robot", "kitchen")


def test_what_is_asked_for_is_what_is_told(
    session: RobotSession, tell: Callable[..., None]
) -> None:
    tell(CUP, BOTTLE, thing("cup_2", 6.3, 4.3, 0.095, rests={"relation": "on", "of": "floor"}))
    named = [one["id"] for one in ask(session, "--of", "cup")[0]["things"]]
    assert named == ["cup_1", "cup_2"]
    assert [one["id"] for one in ask(session, "--on", "coffee table")[0]["things"]] == [
        "cup_1", "bottle_1",
    ]  # fmt: skip
    assert [one["id"] for one in ask(session, "--near", "the bottle")[0]["things"]] == ["cup_1"]
    assert "nothing of that kind" in ask(session, "--of", "keys")[1]


def test_why_not_says_what_is_in_the_way(session: RobotSession, tell: Callable[..., None]) -> None:
    ball = thing("ball_1", 2.2, 1.6, 0.05, rests={"relation": "on", "of": "cup_1"})
    tell(CUP, ball)
    _, text = ask(session, "--of", "cup", "--why-not", "reachable")
    assert "cup_1: on top: the red ball is on it" in text


def test_where_to_look_and_what_has_gone(session: RobotSession, tell: Callable[..., None]) -> None:
    gone = thing("cup_2", 6.3, 4.3, 0.095, cause="the left hand lost it",
                 rests={"relation": "on", "of": "kitchen_table"})  # fmt: skip
    tell(lost=[gone])
    _, text = ask(session, "--of", "cup", "--look")
    assert "20% kitchen_table (cup_2): the left hand lost it" in text
    assert "gone: cup_2, last kitchen_table: the left hand lost it" in text


def test_a_command_is_planned_in_a_scene_that_was_printed_while_something_was_lost(
    session: RobotSession, tell: Callable[..., None], tmp_path: Path
) -> None:
    tell(CUP, lost=[thing("bottle_2", 6.3, 4.3, 0.18, cause="the left hand lost it")])
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(ask(session)[0]))
    base = ["--runtime-base", str(tmp_path / "none")]
    assert main([*base, "plan", "pick up the red cup", "--scene", str(scene)]) == 0


def test_what_a_hand_feels(session: RobotSession, tell: Callable[..., None]) -> None:
    tell(hands={"left": {"class": None, "told": "cup", "felt": "lost", "cause": "it slipped out"}})
    assert "left hand: nothing, felt lost (it slipped out)" in ask(session)[1]


def test_without_perception_or_with_words_it_does_not_know_it_says_so(
    session: RobotSession, tell: Callable[..., None]
) -> None:
    with pytest.raises(UsageError, match="perception tells no scene"):
        ask(session)
    tell(CUP)
    with pytest.raises(UnknownWord, match="unicorn"):
        ask(session, "--of", "unicorn")
    with pytest.raises(UsageError, match="known: bedroom"):
        ask(session, "--from", "the moon")
