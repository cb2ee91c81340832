"""What is told beside a command is left out and lends it its thing; what binds never is."""

import pytest

from vla_deploy.planning.rules.gist import gist_of


@pytest.mark.parametrize(
    ("said", "gist"),
    [
        ("We're done with the film, so the ball should go in the box",
         "the ball should go in the box"),
        ("My ball is on the coffee table, could you run and get it for me?",
         "get the ball on the coffee table for me"),
        ("Of all the cups there, take the red one", "take the red cup"),
        ("a bit more, it's still in my eyes", "a bit more"),
    ],
)  # fmt: skip
def test_what_asks_for_something_is_left(flat, said, gist):
    assert gist_of(flat.request(said)) == gist


@pytest.mark.parametrize(
    "said",
    [
        "go to the kitchen",
        "if it rains, go to the kitchen",
        "I don't want you in there, go to the kitchen",
        "you must never touch that, take the red cup",
        "the weather is fine, it is warm",
        "x" * 500,
    ],
)
def test_where_nothing_may_be_left_out_there_is_no_gist(flat, said):
    assert gist_of(flat.request(said)) == ""
