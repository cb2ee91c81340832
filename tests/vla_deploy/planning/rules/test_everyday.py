"""Commands are understood as people say them at home: what stands beside them does no harm."""

from collections.abc import Callable

import pytest

from vla_deploy.planning.rules.clauses import is_stop

Does = Callable[..., str]
BACK = "navigate_to 2.15 2.05 -1.571"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("keep the ball, but go and pick up the book too", "pick_up ball left; pick_up book right"),
        ("take the red cup and hold on to it", "pick_up red cup; speak I keep it."),
        ("my ball's in the kitchen. could you go and fetch it for me?",
         f"navigate_to kitchen; pick_up ball; {BACK}; speak Here is the ball."),
        ("the red cup goes in the box, the ball goes on the kitchen table",
         "place box in; place kitchen_table on"),
        ("the ball lives on the kitchen table, so pop it back there", "place kitchen_table on"),
        ("i want the ball in the box", "place box in"),
        ("i want the ball on the coffee table",
         f"pick_up ball_1; {BACK}; speak Here is the ball on coffee table."),
        ("i could do with the ball", f"pick_up ball; {BACK}; speak Here is the ball."),
        ("ball in the left hand, book in the right", "pick_up ball left; pick_up book right"),
        ("the ball, take it in your left hand. no, sorry, the right", "pick_up ball right"),
        ("turn left thirty degrees. sorry, i meant sixty", "turn 1.0471975511965976"),
        ("go to the kitchen get the ball and put it in the box",
         "navigate_to kitchen; pick_up ball; place box in"),
        ("red cup in the box and then back here", f"place box in; {BACK}"),
        ("find the ball, it should be in the kitchen", "find_object ball"),
        ("do you happen to know where i've left the keys", "find_object keys"),
        ("put the ball on the table in front of you", "place coffee_table on"),
        ("take the ball to the box and drop it in", "place box in"),
        ("can you look down for me", "look_at down"),
        ("bring us a ball, whichever you like", f"pick_up ball; {BACK}; speak Here is the ball."),
    ],
)  # fmt: skip
def test_what_people_say_at_home_is_done(does: Does, text: str, expected: str) -> None:
    assert does(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "put the red cup in the box >> and put the ball in there too",
            "pick_up ball; place box_1 in",
        ),
        (
            "put the red cup in the box >> the other one goes in there too",
            "pick_up cup_2; place box_1 in",
        ),
    ],
)
def test_what_was_spoken_of_is_meant(goes_on: Does, text: str, expected: str) -> None:
    assert goes_on(text) == expected


@pytest.mark.parametrize(
    "text", ["Stop! Don't move!", "stop. stop right there.", "No! Halt; freeze!"]
)
def test_two_sentences_that_stop_are_a_stop(text: str) -> None:
    assert is_stop(text)


@pytest.mark.parametrize("text", ["Stop! Go to the kitchen.", "Halt the music. Stop.", "..."])
def test_a_sentence_that_does_not_is_none(text: str) -> None:
    assert not is_stop(text)
