"""What follows a no may change one thing of the plan; where that is not clear, nothing."""

import pytest

from vla_deploy.planning.patterns.follow_up import (
    corrected,
    corrected_by,
    corrected_text,
    correction_in,
    with_other,
)
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
        ("the blue one I mean", "the blue one"),
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
    plan = corrected(propose(TAKE, PUT).plan, words)
    told = plan and [next(iter(one.parameters.values())) for one in plan.actions]
    assert told == objects


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("Here is the red cup.", "the blue one", "Here is the blue cup."),
        ("Here is the mug.", "blue", "Here is the blue cup."),
        ("The cup and the ball are here.", "the blue cup", "The blue cup and the ball are here."),
        ("This is your red cup for the box.", "the small blue one",
         "This is the small blue cup for the box."),
        ("I put the red cup in the box.", "the large box", "I put the red cup in the large box."),
        ("Here you are.", "the blue one", "Here you are."),
        ("The ball is red.", "the blue one", "The ball is red."),
    ],
)  # fmt: skip
def test_what_is_said_of_the_thing_is_said_of_the_other(propose, text, words, said):
    plan = corrected(propose(TAKE, PUT, ("speak", {"text": text})).plan, words)
    assert plan is not None
    assert plan.actions[-1].parameters == {"text": said}


def test_what_is_said_of_an_id_is_known_by_its_kind(propose):
    bring = (("pick_up", {"object": "cup_1"}), ("speak", {"text": "Here is the red cup."}))
    plan = corrected(propose(*bring).plan, "the blue one")
    told = [one.parameters for one in plan.actions]
    assert told == [{"object": "the blue cup"}, {"text": "Here is the blue cup."}]


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
        ("no, the green one", "please pick up the green cup now"),
        ("the red one", None),
        ("no, go home", None),
    ],
)
def test_what_was_unclear_is_replaced_in_the_command_that_waits(text, command):
    question = Question(
        text="Which cup?", asked_ns=0, command_text="please pick up the cup now", expression="cup"
    )
    assert corrected_text(question, text, {}) == command


@pytest.mark.parametrize(
    ("steps", "parameters"),
    [
        ([TAKE, PUT], [{"object": "the other cup"}, PUT[1]]),
        ([("place", {"destination": "box", "relation": "in", "arm": "left"})],
         [{"destination": "box", "relation": "in", "object": "the other one"}]),
    ],
)  # fmt: skip
def test_the_other_one_too_is_another_of_the_kind_or_what_the_other_hand_holds(
    propose, steps, parameters
):
    plan = with_other(propose(*steps).plan)
    assert [one.parameters for one in plan.actions] == parameters


def test_between_two_of_a_kind_nothing_is_guessed(propose):
    both = propose(TAKE, ("look_at", {"object": "green cup"})).plan
    assert corrected(both, "the blue one") is None
