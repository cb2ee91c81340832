"""What a command leaves to the one before it is put into full words, or asked for."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from vla_deploy.planning.errors import NothingBefore, NotUnderstood, PlanningError
from vla_deploy.planning.understanding import Conversation, Outcome, Turn

if TYPE_CHECKING:
    from conftest import Flat

GoesOn = Callable[[str], str]
LEFT = "turn 1.5707963267948966"

TALKS = {
    "again": {
        "rotate to the left >> do that once more": LEFT,
        "rotate to the left >> once again the same, please": LEFT,
        "rotate to the left >> Hmm, your face is still in the sun. Do that again.": LEFT,
        "rotate to the left >> again >> and again": LEFT,
        "go to the bedroom >> repeat that please": "navigate_to bedroom",
        "drive backwards 20 cm >> same again": "move -0.2",
        "turn left, then again": f"{LEFT}; {LEFT}",
    },
    "more": {
        "drive ahead 80 cm >> a little further": "move 0.2",
        "drive ahead 80 cm >> a little further >> a bit more": "move 0.2",
        "back up 40 cm >> further": "move -0.2",
        "turn right 60 degrees >> turn a bit more": "turn -0.2618",
        "wait eight seconds >> a lot longer": "wait 8.0",
        "move forward 30 cm >> twice as far": "move 0.6",
    },
    "back": {
        "drive ahead 80 cm >> and back again": "move -0.8",
        "turn right 60 degrees >> the other way": "turn 1.0472",
        "turn right 60 degrees >> go to the bedroom >> back": "navigate_to 2.15 2.05 -1.571",
        "go to the bedroom >> back again": "navigate_to 2.15 2.05 -1.571",
    },
    "another thing": {
        "put the ball in the box >> and the book too": "pick_up book; place box in",
        "pick up the blue cup >> now the red one as well": "pick_up red cup",
        "take the book >> put it on the side table >> do the same with the ball":
            "pick_up ball; place side_table on",
        "put the ball in the box >> and the book too >> also the red cup":
            "pick_up red cup; place box in",
        "look around in the bedroom >> the same in the kitchen":
            "navigate_to kitchen; look_at left; look_at ahead; look_at right; look_at down",
        "go to the bedroom >> then the kitchen": "navigate_to kitchen",
        "look at the red cup >> now the ball": "look_at ball",
        "carry the book to the side table >> and the ball": "pick_up ball; place side_table on",
        "put the book in the box >> the ball too please": "pick_up ball; place box in",
        "put the book in the box >> do that with the ball": "pick_up ball; place box in",
        "bring me the ball >> and the book, please":
            "pick_up book; navigate_to 2.15 2.05 -1.571; speak Here is the book.",
    },
    "another thing, corrected": {
        "pick up the red cup >> no, I meant the blue one": "pick_up blue cup",
        "put the book in the box >> sorry, on the side table": "pick_up book; place side_table on",
        "drive to the bedroom >> no wait, the kitchen": "navigate_to kitchen",
        "pick up the red cup >> not that one, the blue one": "pick_up blue cup",
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("talk", "expected"), [pair for kind in TALKS.values() for pair in kind.items()]
)
def test_a_command_goes_on_from_the_one_before_it(
    goes_on: GoesOn, talk: str, expected: str
) -> None:
    assert goes_on(talk) == expected


@pytest.mark.parametrize("text", ["again", "once more", "a bit more", "back again", "and the ball"])
def test_nothing_before_is_told_in_a_sentence(flat: "Flat", text: str) -> None:
    with pytest.raises(NothingBefore, match="no command yet that I could repeat"):
        flat.plan(text)


@pytest.mark.parametrize("outcome", [Outcome.FAILED, Outcome.CANCELLED, Outcome.REFUSED])
@pytest.mark.parametrize("text", ["again", "a bit more", "back again", "and the ball too"])
def test_what_was_not_done_is_not_repeated(flat: "Flat", text: str, outcome: Outcome) -> None:
    before = flat.after("move forward 30 cm", outcome=outcome)
    with pytest.raises(NothingBefore, match="say the whole command"):
        flat.plan(text, conversation=before)


def test_what_failed_is_not_corrected_either(flat: "Flat") -> None:
    before = flat.after("pick up the red cup", outcome=Outcome.FAILED)
    with pytest.raises(NotUnderstood):
        flat.plan("no, the blue one", conversation=before)


def test_a_stop_ends_what_can_be_repeated(flat: "Flat") -> None:
    stopped = flat.after("turn left").after(Turn(said="stop", outcome=Outcome.CANCELLED))
    with pytest.raises(NothingBefore, match=r'"stop" was not done \(cancelled\)'):
        flat.plan("once more", conversation=stopped)


@pytest.mark.parametrize(
    "talk",
    [
        "pick up the ball >> a bit more",
        "turn left >> again and again and the elephant",
        "put the ball in the box >> and not the book",
        "put the ball in the box >> and that's it",
        "put the ball in the box >> don't do that again",
        "put the ball in the box >> do not do the same with the book",
        "go to the bedroom >> the other way",
    ],
)
def test_what_does_not_go_on_is_refused(goes_on: GoesOn, talk: str) -> None:
    with pytest.raises(PlanningError):
        goes_on(talk)


def test_a_question_of_its_own_moves_nothing(goes_on: GoesOn) -> None:
    told = goes_on("pick up the ball >> and where is the book")
    assert told == "speak The purple book is on the coffee table, in view."


def test_the_goal_of_a_short_command_is_the_whole_one(flat: "Flat") -> None:
    talk = flat.after("put the ball in the box", "and the book too")
    assert talk.turns[-1].words == "put the book in the box"


def test_words_that_another_planner_understood_are_not_guessed_at(flat: "Flat") -> None:
    plan = flat.plan("pick up the ball")
    sung = Conversation().after(Turn(said="sing the ball", plan=plan, outcome=Outcome.SUCCEEDED))
    with pytest.raises(NotUnderstood):
        flat.plan("and the book too", conversation=sung)
