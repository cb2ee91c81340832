from dataclasses import replace

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.planning.understanding import Candidate, Conversation, Question, Verdict, reply

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
        ("the red one", Verdict.CHOSEN, RED),
        ("Blue, please.", Verdict.CHOSEN, BLUE),
        ("I mean the blue cup", Verdict.CHOSEN, BLUE),
        ("left", Verdict.CHOSEN, RED),
        ("the one on the right", Verdict.CHOSEN, BLUE),
        ("the second", Verdict.CHOSEN, BLUE),
        ("the last one", Verdict.CHOSEN, BLUE),
        ("number two", Verdict.CHOSEN, BLUE),
        ("cup_2", Verdict.CHOSEN, BLUE),
        ("either one", Verdict.CHOSEN, RED),
        ("never mind", Verdict.NO, None),
        ("no", Verdict.NO, None),
        ("the cup", Verdict.UNCLEAR, None),
        ("the one", Verdict.UNCLEAR, None),
        ("yes", Verdict.UNCLEAR, None),
        ("the third", Verdict.UNCLEAR, None),
        ("go to the kitchen", Verdict.ANEW, None),
        ("", Verdict.UNCLEAR, None),
    ],
)
def test_an_answer_to_which_one(said: str, verdict: Verdict, chosen: Candidate | None) -> None:
    got = reply(Conversation(question=WHICH), said, now_ns=NS_PER_S)
    assert (got.verdict, got.chosen) == (verdict, chosen)


@pytest.mark.parametrize(
    ("said", "verdict"),
    [
        ("yes", Verdict.YES),
        ("Yes, please do it!", Verdict.YES),
        ("yes please", Verdict.YES),
        ("no thank you", Verdict.NO),
        ("go to the kitchen", Verdict.ANEW),
        ("maybe", Verdict.ANEW),
    ],
)
def test_an_answer_to_yes_or_no(said: str, verdict: Verdict) -> None:
    assert reply(Conversation(question=SURE), said, now_ns=NS_PER_S).verdict is verdict


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
