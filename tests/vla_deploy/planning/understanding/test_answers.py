from dataclasses import replace

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.planning.understanding import (
    Candidate,
    Conversation,
    Question,
    Verdict,
    described,
    guess,
    reply,
)

RED = Candidate(name="cup_1", words="the red one", features=frozenset({"red", "cup", "left"}))
BLUE = Candidate(name="cup_2", words="the blue one", features=frozenset({"blue", "cup", "right"}))
WHICH = Question(
    text="Which cup, the red one or the blue one?",
    asked_ns=0,
    command_text="pick up the cup",
    expression="cup",
    candidates=(RED, BLUE),
    choices={"box": "box_1"},
)
SURE = Question(text="Shall I?", asked_ns=0, command_text="throw the cup away")


@pytest.mark.parametrize(
    ("said", "verdict", "chosen"),
    [
        ("Oh, sorry, the red one then.", Verdict.CHOSEN, RED),
        ("I see. The blue one is what I meant.", Verdict.ANEW, None),
        ("Red. Keep the blue one.", Verdict.CHOSEN, RED),
        ("you can leave the red one where it is", Verdict.CHOSEN, BLUE),
        ("number two", Verdict.CHOSEN, BLUE),
        ("cup_2", Verdict.CHOSEN, BLUE),
        ("either one", Verdict.CHOSEN, RED),
        ("never mind", Verdict.NO, None),
        ("the one", Verdict.UNCLEAR, None),
        ("the third", Verdict.UNCLEAR, None),
        ("both", Verdict.UNCLEAR, None),
    ],
)
def test_an_answer_to_which_one(said: str, verdict: Verdict, chosen: Candidate | None) -> None:
    got = reply(Conversation(question=WHICH), said, now_ns=NS_PER_S)
    assert (got.verdict, got.chosen) == (verdict, chosen)


@pytest.mark.parametrize(
    ("said", "verdict"),
    [
        ("yes", Verdict.YES),
        ("no thank you", Verdict.NO),
        ("go to the kitchen", Verdict.ANEW),
    ],
)
def test_an_answer_to_yes_or_no(said: str, verdict: Verdict) -> None:
    assert reply(Conversation(question=SURE), said, now_ns=NS_PER_S).verdict is verdict


LEFT = Candidate(
    name="ball_1", words="the pink one",
    features=frozenset({"pink", "ball", "left", "desk", "bigger", "first_from_left"}),
)  # fmt: skip
MIDDLE = Candidate(
    name="ball_2", words="the grey one",
    features=frozenset({"grey", "ball", "middle", "shelf", "second_from_left"}),
)  # fmt: skip
LAST = Candidate(
    name="ball_3", words="the green one",
    features=frozenset({"green", "ball", "right", "shelf", "third_from_left"}),
)  # fmt: skip
BALLS = Question(text="Which ball?", asked_ns=0, candidates=(LEFT, MIDDLE, LAST))


@pytest.mark.parametrize(
    ("said", "verdict", "chosen"),
    [
        ("the third ball", Verdict.CHOSEN, LAST),
        ("the second one from the left, please", Verdict.CHOSEN, MIDDLE),
        ("neither of them", Verdict.NO, None),
        ("not the pink one", Verdict.UNCLEAR, None),
        ("not the pink one, the grey one", Verdict.CHOSEN, MIDDLE),
        ("not the ball", Verdict.NO, None),
        ("not that one", Verdict.UNCLEAR, None),
        ("the other one", Verdict.UNCLEAR, None),
        ("not now, go to the kitchen", Verdict.ANEW, None),
    ],
)
def test_an_answer_may_count_compare_and_leave_out(
    said: str, verdict: Verdict, chosen: Candidate | None
) -> None:
    got = reply(Conversation(question=BALLS), said, now_ns=NS_PER_S)
    assert (got.verdict, got.chosen) == (verdict, chosen)


@pytest.mark.parametrize("said", ["the other one", "not the red one", "not the red one, the other"])
def test_of_two_what_is_not_the_one_is_the_other(said: str) -> None:
    got = reply(Conversation(question=WHICH), said, now_ns=NS_PER_S)
    is_told = said.startswith("not")
    assert got.chosen == (BLUE if is_told else None)


@pytest.mark.parametrize("said", ["yes", "right", "Yes, please.", "the red one"])
def test_a_yes_picks_the_only_candidate(said: str) -> None:
    question = replace(WHICH, candidates=(RED,))
    got = reply(Conversation(question=question), said, now_ns=NS_PER_S)
    assert (got.verdict, got.chosen) == (Verdict.CHOSEN, RED)


def test_a_choice_goes_on_with_the_waiting_command_and_all_that_was_chosen() -> None:
    got = reply(Conversation(question=WHICH), "the blue one", now_ns=NS_PER_S)
    assert got.text == "pick up the cup"
    assert got.conversation.question is None
    assert got.conversation.choices == {"box": "box_1", "cup": "cup_2"}


def test_an_unclear_answer_keeps_the_question_open_from_now() -> None:
    got = reply(Conversation(question=WHICH), "the cup", now_ns=9 * NS_PER_S)
    assert got.conversation.question is not None
    assert got.conversation.question.asked_ns == 9 * NS_PER_S


def test_after_the_time_limit_even_a_fitting_answer_is_a_command_of_its_own() -> None:
    late_ns = round((WHICH.limit_s + 1) * NS_PER_S)
    got = reply(Conversation(question=WHICH), "the red one", now_ns=late_ns)
    assert (got.verdict, got.text) == (Verdict.ANEW, "the red one")
    assert got.conversation.question is None


def test_where_an_answer_leaves_several_it_is_asked_once_more() -> None:
    got = reply(Conversation(question=BALLS), "not the grey one", now_ns=NS_PER_S)
    assert got.verdict is Verdict.UNCLEAR
    again = reply(got.conversation, "the left one", now_ns=2 * NS_PER_S)
    assert again.chosen == LEFT


@pytest.mark.parametrize(
    ("said", "full"),
    [
        ("the one next to the book", "pick up the cup next to the book now"),
        ("the cup on the shelf", "pick up the cup on the shelf now"),
        ("the one", None),
    ],
)
def test_an_answer_by_another_thing_makes_the_command_whole(said: str, full: str | None) -> None:
    which = replace(WHICH, command_text="pick up the cup now")
    assert described(which, said) == full
    assert described(replace(which, expression="mug"), said) is None
    assert described(replace(which, command_text="put the cup by the other cup"), said) is None
    assert described(SURE, said) is None


@pytest.mark.parametrize(
    "said",
    [
        "yes I mean no",
        "okay I mean don't do it",
        "yes someone is in the way",
        "yes we are not ready",
    ],
)
def test_a_yes_that_is_taken_back_is_none(said: str) -> None:
    talk = Conversation(question=SURE)
    assert reply(talk, said, now_ns=1).verdict is not Verdict.YES


@pytest.mark.parametrize(
    ("said", "chosen"),
    [
        ("I see. The blue one is what I meant.", BLUE),
        ("the red, my darling", RED),
        ("Red. Keep the blue one.", None),
        ("the red one is what I don't want", None),
        ("what about the red one", None),
        ("is it the red one?", None),
        ("the red book", None),
        ("the red one or the blue one", None),
        ("go to the kitchen", None),
    ],
)
def test_a_guess_is_made_of_what_one_candidate_alone_is_called(
    said: str, chosen: Candidate | None
) -> None:
    got = guess(Conversation(question=WHICH), said)
    assert (None if got is None else got.chosen) == chosen
