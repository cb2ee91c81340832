"""What is unsaid, forbidden, quoted or only told moves nothing before somebody agrees."""

from collections.abc import Callable

import pytest

from benchmarks.planner_bounds import moves
from benchmarks.planner_session import PlannerSession

SENTENCES = (
    "take the ball to the kitchen, I changed my mind",
    "take the ball to the kitchen, I was joking",
    "put the ball in the box, he says",
    "put the keys in the box, he told her",
    "put the ball in the box, that's forbidden",
    "put the keys in the box, I can't let you do that",
    "the ball should be put in the box, but I'll do it",
    "the keys have to be put away, but that can wait",
    "the ball must never be put away",
    "make sure the ball never ends up in the box",
    "it'd be terrible if you put the keys in the box",
    "it would be wrong if you put the ball in the box",
    "the keys will be brought to me",
    "the ball was put away",
    "the ball has been taken to the kitchen",
    "keep the ball on the coffee table until we play",
    "if it rains, take the ball to the kitchen",
    "pretend I am a guest, take the ball to the kitchen",
    "the film says, put the ball in the box",
    "forget to bring me the cup",
    "pretend to bring me the cup",
    "you might have taken the phone to the bedroom",
    "you could have brought me the cup",
    "the keys belong in the box, he thinks",
    "the phone goes to the bedroom, my wife claims",
    "books go in the box, I read",
    "go to the kitchen, said my wife, so I did",
    "come here boy, good dog, sit",
    "keep your eye on the ball, son",
)


@pytest.mark.parametrize("sentence", SENTENCES)
def test_it_does_not_move_at_once(flat: PlannerSession, sentence: str) -> None:
    answer = flat.say(sentence)[1]
    assert answer.outcome != "plan" or not moves(answer.plan or {}), answer


@pytest.mark.parametrize(
    "said",
    [
        "a bit more", "turn a little further", "the other way", "twice as far", "turn back again",
        "now the same but backwards", "back again", "much further", "a bit less",
        "the other one too",
    ],
)  # fmt: skip
def test_more_or_less_of_what_was_done_is_not_done_at_once(flat: PlannerSession, said: str) -> None:
    flat.say("turn left 30 degrees")
    assert flat.say(said)[1].outcome in ("ask", "refuse")


@pytest.mark.parametrize(
    "sentence",
    [
        "bring me the rightmost book, the purple one I have read",
        "bring me the red book, the green one my sister gave me",
        "take the red book to the bedroom, the purple one I need here",
    ],
)
def test_another_thing_that_is_told_of_is_not_taken_at_once(
    session_in: Callable[[str], PlannerSession], sentence: str
) -> None:
    desk = session_in("row")
    answer = desk.say(sentence)[1]
    assert answer.outcome != "plan", answer


@pytest.mark.parametrize(
    "answer",
    [
        "avoid the red",
        "anything instead of the red one, love",
        "forget about red",
        "is the red clean?",
        "Anna, do you like red?",
        "the red if it is clean",
        "I'd hate the red",
    ],
)
def test_an_answer_that_excludes_or_asks_picks_nothing(
    session_in: Callable[[str], PlannerSession], answer: str
) -> None:
    desk = session_in("cups")
    assert desk.say("bring me the cup from the coffee table")[1].outcome == "ask"
    said = desk.say(answer)[1]
    assert said.outcome != "plan", said


def test_an_answer_with_more_words_is_asked_for_again(
    session_in: Callable[[str], PlannerSession],
) -> None:
    desk = session_in("cups")
    desk.say("bring me the cup from the coffee table")
    said = desk.say("the red fella, it suits my mood")[1]
    assert (said.outcome, said.plan) == ("ask", None)
