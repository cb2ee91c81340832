from dataclasses import replace

import pytest

from vla_deploy.planning.understanding import AnswerVerdict, Candidate, Question, judge_answer

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
        ("Oh, sorry, the red one then.", AnswerVerdict.CHOSEN, RED),
        ("I see. The blue one is what I meant.", AnswerVerdict.MIXED, None),
        ("Red. Keep the blue one.", AnswerVerdict.MIXED, None),
        ("you can leave the red one where it is", AnswerVerdict.MIXED, None),
        ("the red one is what I don't want", AnswerVerdict.MIXED, None),
        ("the red one or the blue one", AnswerVerdict.MIXED, None),
        ("what about the red one", AnswerVerdict.MIXED, None),
        ("the red book", AnswerVerdict.MIXED, None),
        ("go to the kitchen", AnswerVerdict.ANEW, None),
        ("the one next to the book", AnswerVerdict.ANEW, None),
        ("the bigger one", AnswerVerdict.UNCLEAR, None),
        ("the one on the right", AnswerVerdict.CHOSEN, BLUE),
        ("right", AnswerVerdict.CHOSEN, BLUE),
        ("yes", AnswerVerdict.UNCLEAR, None),
        ("the second", AnswerVerdict.CHOSEN, BLUE),
        ("cup_2", AnswerVerdict.CHOSEN, BLUE),
        ("either one", AnswerVerdict.CHOSEN, RED),
        ("never mind", AnswerVerdict.NO, None),
        ("the one", AnswerVerdict.UNCLEAR, None),
        ("the third", AnswerVerdict.UNCLEAR, None),
        ("both", AnswerVerdict.UNCLEAR, None),
    ],
)
def test_an_answer_to_which_one(
    said: str, verdict: AnswerVerdict, chosen: Candidate | None
) -> None:
    assert judge_answer(WHICH, said) == (verdict, chosen)


@pytest.mark.parametrize(
    ("said", "verdict"),
    [
        ("yes", AnswerVerdict.YES),
        ("no thank you", AnswerVerdict.NO),
        ("go to the kitchen", AnswerVerdict.ANEW),
    ],
)
def test_an_answer_to_yes_or_no(said: str, verdict: AnswerVerdict) -> None:
    assert judge_answer(SURE, said) == (verdict, None)


LEFT = Candidate(
    name="ball_1", words="the pink one",
    features=frozenset({"pink", "ball", "left", "desk"}),
)  # fmt: skip
MIDDLE = Candidate(
    name="ball_2", words="the grey one",
    features=frozenset({"grey", "ball", "middle", "shelf"}),
)  # fmt: skip
LAST = Candidate(
    name="ball_3", words="the green one",
    features=frozenset({"green", "ball", "right", "shelf"}),
)  # fmt: skip
BALLS = Question(text="Which ball?", asked_ns=0, candidates=(LEFT, MIDDLE, LAST))


@pytest.mark.parametrize(
    ("said", "verdict", "chosen"),
    [
        ("the third ball", AnswerVerdict.CHOSEN, LAST),
        ("the second one from the left, please", AnswerVerdict.UNCLEAR, None),
        ("the last one", AnswerVerdict.CHOSEN, LAST),
        ("neither of them", AnswerVerdict.NO, None),
        ("not the pink one", AnswerVerdict.UNCLEAR, None),
        ("not the pink one, the grey one", AnswerVerdict.UNCLEAR, None),
        ("not the ball", AnswerVerdict.UNCLEAR, None),
        ("not that one", AnswerVerdict.UNCLEAR, None),
        ("the other one", AnswerVerdict.UNCLEAR, None),
        ("not the grey one", AnswerVerdict.UNCLEAR, None),
        ("not now, go to the kitchen", AnswerVerdict.ANEW, None),
    ],
)
def test_an_answer_may_count_compare_and_leave_out(
    said: str, verdict: AnswerVerdict, chosen: Candidate | None
) -> None:
    assert judge_answer(BALLS, said) == (verdict, chosen)


@pytest.mark.parametrize("said", ["the other one", "not the red one", "but not the red one"])
def test_of_two_what_is_not_the_one_is_the_other(said: str) -> None:
    assert judge_answer(WHICH, said)[1] == (BLUE if "not" in said else None)


@pytest.mark.parametrize("said", ["yes", "right", "Yes, please.", "the red one"])
def test_a_yes_picks_the_only_candidate(said: str) -> None:
    question = replace(WHICH, candidates=(RED,))
    assert judge_answer(question, said) == (AnswerVerdict.CHOSEN, RED)


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
    assert judge_answer(SURE, said)[0] is not AnswerVerdict.YES
