"""What follows a no may change one thing of the plan; where that is not clear, nothing."""

import pytest

from vla_deploy.planning.dialogue.correction import corrected, correction_in

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
        ("the ball", None),
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


def test_between_two_of_a_kind_nothing_is_guessed(propose):
    both = propose(TAKE, ("look_at", {"object": "green cup"})).plan
    assert corrected(both, "the blue one") is None
