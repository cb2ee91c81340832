"""What was read becomes a command only if everything speaks for it; each refusal says why."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.inference.manifest import Calibration
from vla_deploy.speech.transcript import Transcript, confidence
from vla_deploy.speech.verdict import OWN_VOICE, PhraseJudgement, PhraseVerdict, judge, stops
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


@pytest.mark.parametrize(
    ("changed", "verdict"),
    [
        ({}, PhraseVerdict.ACCEPTED),
        ({"confidence": 0.24}, PhraseVerdict.REJECTED),
        ({"confidence": 0.25}, PhraseVerdict.DOUBTED),
        ({"confidence": 0.49}, PhraseVerdict.DOUBTED),
        ({"confidence": 0.4, "no_speech": 0.93}, PhraseVerdict.REJECTED),
    ],
)
def test_a_sure_reading_is_a_command_and_the_planner_makes_sense_of_an_unsure_one(
    changed: dict[str, Any], verdict: PhraseVerdict
) -> None:
    judgement = judged(**changed)
    assert judgement.verdict is verdict
    assert (judgement.reason == "") is (verdict is PhraseVerdict.ACCEPTED)


@pytest.mark.parametrize(
    ("said", "heard", "reason"),
    [
        ("Which cup do you mean?", "pick up the red cup", ""),
        ("Which cup, the red one or the blue one?", "the red one", ""),
        ("Which one, the kitchen or the bedroom?", "the kitchen", ""),
        ("Shall I pick up the red cup and put it in the box?", "pick up the blue cup", ""),
        ("Shall I pick up the cup and put it in the box?", "put the cup in the box", ""),
        ("Shall I go to the kitchen?", "no, go to the bedroom and wait for me there", ""),
        ("I can go to the kitchen and tidy up.", "go to the kitchen, then bring the red cup", ""),
        ("Shall I pick up the red cup and put it in the box?", "pick up the red cup", OWN_VOICE),
        ("Shall I go and pick up the red cup, and then the blue one?", "Pick up the red cup.",
         OWN_VOICE),
        ("Which one?", "which one", OWN_VOICE),
        ("I pick up the red cup.", "up the red cup", OWN_VOICE),
        ("I pick up the red cup", "Pick up the red cup.", OWN_VOICE),
        ("I pick up the red cup.", "I pick up the red cap", OWN_VOICE),
        ("I go to the kitchen.", "go to the kitchen", OWN_VOICE),
    ],
)  # fmt: skip
def test_a_person_is_heard_who_answers_what_the_robot_said_and_the_robot_itself_is_not(
    said: str, heard: str, reason: str
) -> None:
    judgement = judged(text=heard, own_words=said)
    assert judgement.reason == reason
    assert judgement.verdict is (PhraseVerdict.REJECTED if reason else PhraseVerdict.ACCEPTED)
    assert not judgement.ask_again


@pytest.mark.parametrize(
    ("changed", "reason", "ask_again"),
    [
        ({"text": " ... "}, "a sound without words", False),
        ({"text": "Please. Thank you!"}, "a courtesy", False),
        ({"confidence": 0.2}, "understood by 20%, at least 50% is needed", True),
        ({"language": "fr", "is_foreign": True}, "spoken in fr, which is not understood", True),
        ({"no_speech": 0.93}, "nobody spoke, by 93%", False),
        ({"compression": 4.2}, "the text repeats itself, by 4.2", False),
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
