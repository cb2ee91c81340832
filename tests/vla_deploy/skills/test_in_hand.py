"""What is in a hand is the thing that was meant, not another one of its kind."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from vla_deploy.plans.plan import Action
from vla_deploy.plans.symbolic.state import SymbolicState
from vla_deploy.skills.actions.pick import pick_up
from vla_deploy.skills.context import Held, SkillContext
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.movements.arms import recall_hands
from vla_deploy.skills.world_check import WorldCheck

if TYPE_CHECKING:
    from conftest import StandingLink

FREE: Any = {"left": None, "right": None}
A_BALL = Held(kind="ball", colour="green", width_m=0.06, below_grip_m=0.03)


def thing(name: str, colour: str = "red", held_by: str = "") -> dict[str, Any]:
    return {
        "id": name,
        "class": name.partition("_")[0],
        "colour": colour,
        "position_m": [1.3, 2.0, 0.5],
        "held_by": held_by,
    }


def a_cup(colour: str = "red") -> Held:
    return Held(kind="cup", colour=colour, width_m=0.07, below_grip_m=0.05)


@pytest.fixture
def takes(context: SkillContext, standing: "StandingLink"):
    """Tell whether `pick_up` wants a hand for a thing; the one it may use holds a ball."""

    def takes(wanted: str, objects: list[dict[str, Any]], **hands: Held) -> bool:
        standing.objects = objects
        context.hands = FREE | {"right": A_BALL} | hands
        try:
            next(pick_up(context, {"object": wanted, "arm": "right"}), None)
        except NotPossible as error:
            assert "no hand is free" in str(error)
            return True
        return False

    return takes


@pytest.fixture
def missing(context: SkillContext, standing: "StandingLink"):
    """Return what the world shows instead of a thing in a hand."""

    def missing(wanted: str, objects: list[dict[str, Any]], **hands: Held) -> str | None:
        standing.objects = objects
        context.hands = FREE | hands
        action = Action(id="a", skill="pick_up", parameters={"object": wanted})
        return WorldCheck(context).missing_effect(action, SymbolicState(), 0)

    return missing


TWO_CUPS = [thing("cup_1", held_by="left"), thing("cup_2", "blue")]


@pytest.mark.parametrize(
    ("wanted", "is_taken"),
    [("cup_2", True), ("blue cup", True), ("cup_1", False), ("red cup", False), ("cup", False)],
)
def test_another_cup_is_taken_while_one_is_held(takes, wanted: str, is_taken: bool):
    assert takes(wanted, TWO_CUPS, left=a_cup()) == is_taken


def test_an_id_that_nobody_knows_is_not_what_a_hand_holds(takes):
    assert takes("cup_7", TWO_CUPS, left=a_cup())


def test_what_is_told_to_be_held_and_was_let_go_is_taken_again(takes):
    assert takes("cup_1", TWO_CUPS)


def test_words_are_held_by_kind_and_colour_where_the_scene_cannot_tell(takes, standing):
    assert not takes("red cup", [], left=a_cup())
    standing.is_silent = True
    assert not takes("red cup", TWO_CUPS, left=a_cup())
    assert takes("blue cup", TWO_CUPS, left=a_cup())


@pytest.mark.parametrize("wanted", ["cup_1", "red cup", "cup"])
def test_the_thing_that_was_meant_is_felt(missing, wanted: str):
    assert missing(wanted, TWO_CUPS, left=a_cup()) == ""


@pytest.mark.parametrize("wanted", ["cup_2", "blue cup"])
def test_another_thing_of_its_kind_is_not_what_was_taken(missing, wanted: str):
    why = missing(wanted, TWO_CUPS, left=a_cup())
    assert why == f"no hand feels the {wanted}, but cup_1"


def test_a_hand_of_which_the_scene_tells_nothing_yet_may_hold_it(missing):
    assert missing("cup_2", TWO_CUPS, left=a_cup(), right=a_cup("blue")) == ""
    assert missing("cup_7", [], left=a_cup()) == ""


def test_what_was_meant_is_felt_though_it_is_called_otherwise_now(missing):
    can = {**thing("cup_1", held_by="left"), "class": "can"}
    assert missing("cup_1", [can], left=a_cup()) == ""


def test_nothing_in_the_hands_is_said(missing):
    assert missing("cup_2", [thing("cup_2", "blue")]) == "no hand feels the cup_2"


@pytest.mark.parametrize(
    ("width_m", "kind"),
    [(0.066, "cup"), (0.03, "object")],
    ids=["as far apart as it is wide", "another thing is between the fingers"],
)
def test_after_a_restart_a_hand_holds_what_the_executor_before_said_if_it_feels_so(
    context: SkillContext, standing: "StandingLink", width_m: float, kind: str
) -> None:
    gripper = context.robot.hands["left"].gripper
    index, ratio = context.robot.joint_index[gripper], context.robot.hands["left"].opening_ratio
    standing.positions = np.zeros(len(context.robot.joint_names))
    standing.efforts = np.zeros(len(context.robot.joint_names))
    standing.positions[index], standing.efforts[index] = width_m / ratio, 0.25
    assert recall_hands(context, {"left": a_cup(), "right": A_BALL})
    assert context.hands["left"].kind == kind
    assert context.hands["right"] is None, "its fingers are closed upon nothing"
