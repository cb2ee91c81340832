"""What was read becomes a command only if everything speaks for it; each refusal says why."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.inference.manifest import Calibration
from vla_deploy.speech.transcript import Transcript, confidence
from vla_deploy.speech.verdict import PhraseJudgement, PhraseVerdict, judge, stops
from vla_deploy.speech.words import is_stop, is_unfinished, words_of

TRANSCRIPT = Transcript(
    text="Pick up the red cup.",
    log_probability=-0.1,
    no_speech=0.01,
    compression=0.9,
    language="en",
    confidence=0.9,
)
LEAST = 0.5


def judged(own_words: str = "", **changes: Any) -> PhraseJudgement:
    return judge(replace(TRANSCRIPT, **changes), own_words, LEAST)


def test_a_sure_reading_is_a_command() -> None:
    judgement = judged()
    assert (judgement.verdict, judgement.reason) == (PhraseVerdict.ACCEPTED, "")


@pytest.mark.parametrize(
    ("changed", "reason", "ask_again"),
    [
        ({"text": " ... "}, "a sound without words", False),
        ({"text": "Please. Thank you!"}, "a courtesy", False),
        ({"confidence": 0.2}, "understood by 20%, at least 50% is needed", True),
        ({"language": "fr", "is_foreign": True}, "spoken in fr, which is not understood", True),
        ({"no_speech": 0.93}, "nobody spoke, by 93%", False),
        ({"compression": 4.2}, "the text repeats itself, by 4.2", False),
        ({"own_words": "I pick up the red cup"}, "the robot heard itself", False),
        (
            {"own_words": "Shall I go and pick up the red cup, and then the blue one?"},
            "the robot heard itself",
            False,
        ),
    ],
)
def test_what_speaks_against_it_is_told(
    changed: dict[str, Any], reason: str, ask_again: bool
) -> None:
    judgement = judged(**changed)
    assert judgement.verdict is PhraseVerdict.REJECTED
    assert reason in judgement.reason
    assert judgement.ask_again is ask_again


@pytest.mark.parametrize(
    ("confidence", "verdict"),
    [(0.24, PhraseVerdict.REJECTED), (0.25, PhraseVerdict.DOUBTED), (0.49, PhraseVerdict.DOUBTED)],
)
def test_what_is_only_not_sure_enough_is_for_the_planner_to_make_sense_of(
    confidence: float, verdict: PhraseVerdict
) -> None:
    assert judged(confidence=confidence).verdict is verdict


def test_what_else_speaks_against_it_is_no_doubt() -> None:
    judgement = judged(confidence=0.4, no_speech=0.93)
    assert judgement.verdict is PhraseVerdict.REJECTED


@pytest.mark.parametrize(
    ("said", "answer"),
    [
        ("Which cup do you mean?", "pick up the red cup"),
        ("Which cup, the red one or the blue one?", "the red one"),
        ("Which one, the kitchen or the bedroom?", "the kitchen"),
        ("Shall I pick up the red cup and put it in the box?", "pick up the blue cup"),
        ("Shall I pick up the cup and put it in the box?", "put the cup in the box"),
        ("Shall I go to the kitchen?", "no, go to the bedroom and wait for me there"),
        ("I can go to the kitchen and tidy up.", "go to the kitchen, then bring me the red cup"),
    ],
)
def test_a_person_who_answers_what_the_robot_said_is_heard(said: str, answer: str) -> None:
    assert judged(text=answer, own_words=said).verdict is PhraseVerdict.ACCEPTED


@pytest.mark.parametrize(
    ("said", "echo"),
    [
        ("Shall I pick up the red cup and put it in the box?", "pick up the red cup"),
        ("Which one?", "which one"),
        ("I pick up the red cup.", "up the red cup"),
        ("I pick up the red cup.", "I pick up the red cap"),
        ("I go to the kitchen.", "go to the kitchen"),
    ],
)
def test_what_the_robot_said_itself_is_no_command(said: str, echo: str) -> None:
    assert judged(text=echo, own_words=said).reason == "the robot heard itself"


@pytest.mark.parametrize(
    ("text", "confidence", "own_words", "is_one"),
    [
        ("robot stop", 0.66, "", True),
        ("stop", 0.25, "", True),
        ("Stop, please!", 0.25, "I am on my way", True),
        ("stop", 0.24, "", False),
        ("rover, halt", 0.3, "", True),
        ("Stop, stop, stop it, robot!", 0.25, "", True),
        ("I said stop!", 0.25, "", True),
        ("could you just stop what you're doing", 0.25, "", True),
        ("the bus stop", 0.3, "", False),
        ("stop before you hit the chair", 0.5, "", True),
        ("stop before you hit the chair", 0.49, "", False),
        ("do not stop", 0.9, "", True),
        ("he stopped at the freezer", 1.0, "", False),
        ("stop", 0.9, "All right, I stop.", False),
        ("stop", 0.9, "I have stopped", True),
    ],
)
def test_words_stop_the_robot_whatever_any_network_says_but_for_its_own(
    text: str, confidence: float, own_words: str, is_one: bool
) -> None:
    assert stops(text, confidence, own_words, {"rover"}) is is_one


@pytest.mark.parametrize(
    ("text", "is_call"),
    [
        *((one, True) for one in ("Stop!", "stop stop stop", "robot, freeze", "Please halt now")),
        *((one, False) for one in ("stop at the table", "", "please", "do not stop", "it")),
    ],
)
def test_a_call_to_stop_is_nothing_but_such_words(text: str, is_call: bool) -> None:
    assert is_stop(text) is is_call


@pytest.mark.parametrize(
    ("text", "unfinished"),
    [
        ("Pick up the", True),
        ("put it in", True),
        ("pick up the cup and", True),
        ("", True),
        ("pick up the red cup", False),
        ("turn left", False),
        ("go on", True),
    ],
)
def test_words_that_end_no_command_are_known(text: str, unfinished: bool) -> None:
    assert is_unfinished(text) is unfinished


def test_words_are_told_from_punctuation() -> None:
    assert words_of("What's that — 2 cups?") == ("what's", "that", "2", "cups")


def test_confidence_grows_with_what_speaks_for_a_reading() -> None:
    def sure(**changes: Any) -> float:
        return confidence(replace(TRANSCRIPT, **changes), None)

    assert sure() > 0.9
    assert sure() > sure(log_probability=-0.5) > sure(log_probability=-1.0) > sure(no_speech=1e3)
    assert sure(compression=3.0) < sure(compression=2.0) == sure()
    assert sure(text="") == 0.0
    assert sure(log_probability=-1e6) == pytest.approx(0.0)


def test_a_calibration_of_the_manifest_is_used() -> None:
    flat = Calibration(bias=0.0, log_probability=0.0, no_speech=0.0, compression=0.0)
    assert confidence(TRANSCRIPT, flat) == 0.5
