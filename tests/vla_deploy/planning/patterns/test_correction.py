"""What follows a no may change one thing of the plan; where that is not clear, nothing."""

import pytest

from vla_deploy.planning.patterns.follow_up import corrected_by, corrected_text, correction_in
from vla_deploy.planning.understanding import Question

TAKE = ("pick_up", {"object": "red cup"})
PUT = ("place", {"destination": "box", "relation": "in"})


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        ("no, the blue one", "the blue one"),
        ("No I meant the blue cup.", "the blue cup"),
        ("not that one, the ball", "the ball"),
        ("no wait, the blue one", "the blue one"),
        ("Wait, no, I said the blue one", "the blue one"),
        ("sorry, the blue one", "the blue one"),
        ("I mean the phone", "the phone"),
        ("the blue one I mean", ""),
        ("the other one", "the other one"),
        ("no phone", ""),
        ("no", ""),
        ("the blue one", ""),
        ("nobody is here", ""),
    ],
)
def test_what_follows_a_no_is_found(text, rest):
    assert correction_in(text) == rest


@pytest.mark.parametrize(
    ("words", "objects"),
    [
        ("the blue one", ["the blue cup", "box"]),
        ("blue", ["blue cup", "box"]),
        ("the blue cup", ["the blue cup", "box"]),
        ("the small box", ["red cup", "the small box"]),
        ("the ball", ["the ball", "box"]),
        ("the other one", ["the other cup", "box"]),
        ("narnia", None),
    ],
)
def test_the_only_thing_that_can_be_meant_is_replaced(propose, words, objects):
    plan = corrected_by(propose(TAKE, PUT).plan, f"no, {words}", {})
    told = plan and [next(iter(one.parameters.values())) for one in plan.actions]
    assert told == objects


@pytest.mark.parametrize(
    ("steps", "text", "parameters"),
    [
        ([("navigate_to", {"place": "kitchen"})], "no, the bedroom", [{"place": "the bedroom"}]),
        ([TAKE, PUT], "no, the bedroom", [{"object": "red cup"}, {"destination": "the bedroom"}]),
        ([TAKE], "no, the bedroom", None),
        ([("navigate_to", {"place": "kitchen"}), ("navigate_to", {"place": "hall"})],
         "no, the bedroom", None),
    ],
)  # fmt: skip
def test_a_place_takes_the_place_of_the_only_one(propose, steps, text, parameters):
    plan = corrected_by(propose(*steps).plan, text, {"bedroom": "bedroom"})
    assert (plan and [one.parameters for one in plan.actions]) == parameters


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ("no, the can", "please pick up the can now"),
        ("I mean the phone", "please pick up the phone now"),
        ("no, the green one", None),
        ("the red one", None),
        ("no, go home", None),
    ],
)
def test_what_was_unclear_is_replaced_in_the_command_that_waits(text, command):
    question = Question(
        text="Which cup?", asked_ns=0, command_text="please pick up the cup now", expression="cup"
    )
    assert corrected_text(question, text) == command


def test_between_two_of_a_kind_nothing_is_guessed(propose):
    both = propose(TAKE, ("look_at", {"object": "green cup"})).plan
    assert corrected_by(both, "no, the blue one", {}) is None


def test_a_plan_that_speaks_is_not_corrected(propose):
    bring = propose(TAKE, ("speak", {"text": "Here is the red cup."})).plan
    assert corrected_by(bring, "no, the blue one", {}) is None
