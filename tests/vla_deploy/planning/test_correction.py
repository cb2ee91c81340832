"""What follows a no may change one thing of the plan; where that is not clear, nothing."""

import pytest

from vla_deploy.planning.correction import corrected, correction_in

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


def test_between_two_of_a_kind_nothing_is_guessed(propose):
    both = propose(TAKE, ("look_at", {"object": "green cup"})).plan
    assert corrected(both, "the blue one") is None
