"""Whatever other processes write, the planner answers clearly and takes the next command."""

import math
from typing import Any, Final

import pytest

from benchmarks.planner_corpus import home, scenes
from benchmarks.planner_session import PlannerSession
from benchmarks.planner_told import scene_document

CLEAR: Final = ("plan", "ask", "refuse")


def assert_goes_on(flat: PlannerSession) -> None:
    flat.tell(scenes()["tidy"].world(home()))
    assert flat.say("go to the kitchen")[1].outcome == "plan"


UTTERANCES: Final[dict[str, dict[str, Any]]] = {
    "nothing": {},
    "no text": {"text": None},
    "a number": {"text": 5},
    "a list": {"text": ["go", "to", "the", "kitchen"]},
    "blanks": {"text": " \n\t "},
    "what cannot be seen": {"text": "\u200b\u202e\x00"},
    "half a character": {"text": "go to the \ud800"},
    "a long word": {"text": "a" * 50_000},
    "a place that nobody named": {"text": "take the bottle there"},
    "many brackets": {"text": "(" * 30_000},
    "many commas": {"text": "go, " * 10_000},
    "a plan that is a number": {"plan": 7},
    "a plan that is a text": {"plan": "move forward"},
    "a plan of plans": {"plan": {"plan": {"plan": {"plan": []}}}},
    "deep": {"plan": {"goal": "x", "actions": [{"skill": {"skill": {"skill": []}}}]}},
    "confidence of another type": {"text": "go to the kitchen", "heard": "surely"},
    "confidence that is none": {"text": "go to the kitchen", "heard": {"confidence": math.nan}},
    "confidence of a list": {"text": "go to the kitchen", "heard": {"confidence": [1]}},
}


@pytest.mark.parametrize("utterance", UTTERANCES.values(), ids=UTTERANCES)
def test_an_utterance_of_any_form_has_a_clear_outcome(
    flat: PlannerSession, utterance: dict[str, Any]
) -> None:
    _, answer = flat.give(**utterance)
    allowed = CLEAR if utterance.get("text") == "go to the kitchen" else CLEAR[1:]
    assert answer.outcome in allowed, answer.text
    if answer.outcome == "ask":
        assert flat.say("never mind")[1].outcome == "refuse"
    assert_goes_on(flat)


def told(**changes: Any) -> dict[str, Any]:
    document = scene_document(scenes()["tidy"].world(home()), 10**9)
    document["objects"][0] |= changes
    return document


SCENES: Final[dict[str, dict[str, Any]]] = {
    "empty": {},
    "objects of another type": {"stamp_ns": 1, "objects": "none"},
    "an object that is a number": {"stamp_ns": 1, "objects": [3]},
    "a place beyond all floors": told(position_m=[1e6, -1e6, 1e6]),
    "a place of two numbers": told(position_m=[1.0, 2.0]),
    "a size of another sign": told(size_m=[-1.0, 0.0, 0.0]),
    "resting in itself": told(rests={"relation": "in", "of": "box_1"}),
    "a stamp of another type": {"stamp_ns": "now", "objects": []},
}


@pytest.mark.parametrize("document", SCENES.values(), ids=SCENES)
def test_a_scene_of_any_form_keeps_nobody_from_answering(
    flat: PlannerSession, document: dict[str, Any]
) -> None:
    flat.show("scene", document)
    for text in ("pick up the red cup", "put the ball in the box", "where is the box"):
        _, answer = flat.say(text)
        assert answer.outcome in CLEAR, answer.text
    assert_goes_on(flat)
