"""Commands, stops, refusals and a polite question leave by their own ways, and not too often."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.speech.asr_pipeline import HeardPhrase
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.event_publisher import SpeechEvents
from vla_deploy.speech.sound import NOTHING
from vla_deploy.speech.transcript import Transcript
from vla_deploy.speech.verdict import PhraseJudgement, PhraseVerdict

TOPICS = ("heard", "utterance", "say", "operator")


def heard(
    text: str,
    verdict: PhraseVerdict,
    *,
    ask_again: bool = False,
    others: tuple[tuple[str, float], ...] = (),
) -> HeardPhrase:
    reading = Transcript(
        text=text,
        log_probability=-0.25,
        no_speech=0.02,
        compression=0.9,
        language="en",
        others=others,
        confidence=0.83,
    )
    return HeardPhrase(
        phrase=Phrase(began_ns=NS_PER_S // 2, ended_ns=NS_PER_S, samples=NOTHING),
        transcript=reading,
        judgement=PhraseJudgement(verdict=verdict, reason="because", ask_again=ask_again),
    )


@pytest.fixture
def space(tmp_path: Path, clock: ManualClock) -> Iterator[SharedSpace]:
    space = SharedSpace(tmp_path / "ipc", clock)
    yield space
    space.close()


@pytest.fixture
def told(space: SharedSpace) -> Callable[[str], list[Any]]:
    readers = {name: space.ring_reader(name, from_start=True) for name in TOPICS}
    return lambda name: [dict(event.payload) for event in readers[name].drain()]


@pytest.fixture
def publisher(space: SharedSpace, clock: ManualClock) -> SpeechEvents:
    return SpeechEvents(space, clock)


def test_a_command_goes_to_the_planner_with_what_speaks_for_it(
    publisher: SpeechEvents, told: Any, clock: ManualClock
) -> None:
    clock.ns = NS_PER_S + 300_000_000
    publisher.publish(heard("pick up the red cup", PhraseVerdict.ACCEPTED))
    (utterance,) = told("utterance")
    assert (utterance["text"], utterance["source"]) == ("pick up the red cup", "voice")
    assert utterance["command_id"].startswith("voice-")
    assert utterance["heard"] == {"confidence": 0.83, "others": []}
    (event,) = told("heard")
    assert (event["verdict"], event["text"]) == ("accepted", "pick up the red cup")
    assert event["told_ns"] - event["ended_ns"] == 300_000_000
    assert told("say") == told("operator") == []
    assert publisher.document()["end_to_text_p95_s"] == pytest.approx(0.3, rel=0.13)


def test_doubted_words_go_to_the_planner_with_what_may_have_been_said_instead(
    publisher: SpeechEvents, told: Any
) -> None:
    others = (("put it in the box", 0.7), ("word " * 60, 0.1))
    publisher.publish(heard("put it in the boss", PhraseVerdict.DOUBTED, others=others))
    (utterance,) = told("utterance")
    given = utterance["heard"]
    assert given["others"] == [{"text": "put it in the box", "odds": 0.7}]
    assert (given["doubted"], given["ask_again"]) == (True, True)
    assert told("say") == [], "the planner asks, if it makes no sense of them"
    publisher.publish(heard("put it in the boss", PhraseVerdict.DOUBTED))
    assert told("utterance")[0]["heard"]["ask_again"] is False, "nobody is asked again so soon"


def test_the_robot_asks_again_ever_more_seldom_until_it_understands(
    publisher: SpeechEvents, told: Any, clock: ManualClock
) -> None:
    asked = []
    for second in range(120):
        clock.ns = (10 + second) * NS_PER_S
        publisher.publish(heard("mumble", PhraseVerdict.REJECTED, ask_again=True))
        asked += [second] * len(told("say"))
    assert asked == [0, 10, 30, 70]
    publisher.publish(heard("turn left", PhraseVerdict.ACCEPTED))
    publisher.publish(heard("mumble", PhraseVerdict.REJECTED, ask_again=True))
    (order,) = told("say")
    assert "say it again" in order["text"]
    assert order["source"] == "speech"
