"""The robot's voice on a stepped clock: order, interruption, a speaker that goes and comes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S
from vla_deploy.speech.voice.robot_voice import MOST_WAITING, TAIL_NS

if TYPE_CHECKING:
    from conftest import VoiceRig

LONG = "I have put the red cup into the box, and now I am on my way back to the kitchen table"


def test_what_is_to_be_said_is_heard_whole_and_in_its_time(rig: VoiceRig) -> None:
    rig.say("a")
    rig.run_until("a", "finished")
    assert rig.events == [("a", "began"), ("a", "finished")]
    said = rig.speaker.said()
    expected = EspeakEngine().synthesise("I am on my way").samples(rig.format, 0.8)
    assert np.array_equal(said, expected)
    took_ns = rig.times_ns["a", "finished"] - rig.times_ns["a", "began"]
    assert took_ns == pytest.approx(rig.format.duration_ns(len(said)), abs=2 * rig.step_ns)


def test_texts_follow_each_other_first_come_first_said(rig: VoiceRig) -> None:
    for say_id in "abc":
        rig.say(say_id, "one")
    rig.run_until("c", "finished")
    assert [say_id for say_id, event in rig.events if event == "began"] == ["a", "b", "c"]


def test_a_person_who_speaks_silences_the_voice_within_its_lead(rig: VoiceRig) -> None:
    rig.say("long", LONG)
    rig.say("next", "and more")
    rig.run_until("long", "began")
    rig.run(0.5)
    rig.voice.fall_silent("somebody spoke")
    rig.speaker.said()
    rig.run(2.0)
    assert rig.events[1:] == [("next", "dropped"), ("long", "interrupted")]
    assert rig.reasons["long"] == "somebody spoke"
    assert len(rig.speaker.said()) == 0, "no more was handed over than had to be"


def test_an_emergency_stop_silences_the_voice(rig: VoiceRig) -> None:
    rig.say("long", LONG)
    rig.run_until("long", "began")
    operator = rig.space.ring_writer("operator")
    operator.publish({"act": "arm", "source": "test", "reason": ""})
    rig.run(0.1)
    assert len(rig.events) == 1
    operator.publish({"act": "estop", "source": "test", "reason": ""})
    rig.run(0.02)
    assert rig.events[1:] == [("long", "interrupted")]


def test_an_order_is_taken_back_waiting_or_sounding(rig: VoiceRig) -> None:
    rig.say("long", LONG)
    rig.say("next", "and more")
    rig.run_until("long", "began")
    rig.publish({"say_id": "next", "cancel": True})
    rig.publish({"say_id": "long", "cancel": True})
    rig.publish({"say_id": "nobody", "cancel": True})
    rig.run(0.1)
    assert rig.events[1:] == [("next", "dropped"), ("long", "interrupted")]


def test_a_lost_speaker_fails_what_is_said_and_a_replug_brings_the_voice_back(
    rig: VoiceRig,
) -> None:
    rig.say("long", LONG)
    rig.run_until("long", "began")
    rig.unplug()
    rig.say("next", "and more")
    rig.run(0.2)
    assert rig.events[1:] == [("long", "failed"), ("next", "failed")]
    assert "plug it in" in rig.reasons["next"]
    assert rig.voice.document()["state"] == "away"
    rig.replug()
    rig.run(5.0)
    assert rig.voice.document()["state"] == "ready"
    rig.say("again")
    rig.run_until("again", "finished")


def test_while_it_speaks_and_rings_out_it_says_what_sounds(rig: VoiceRig) -> None:
    assert rig.voice.playing is None
    rig.say("a")
    rig.run_until("a", "began")
    playing = rig.voice.playing
    assert playing is not None
    assert (playing.say_id, playing.text) == ("a", "I am on my way")
    assert playing.echo_db < 0.0
    rig.run_until("a", "finished")
    assert rig.voice.playing == playing
    rig.run(TAIL_NS / NS_PER_S)
    assert rig.voice.playing is None


def test_more_than_can_wait_is_dropped(rig: VoiceRig) -> None:
    rig.say("long", LONG)
    rig.run_until("long", "began")
    for number in range(MOST_WAITING + 1):
        rig.say(f"next-{number}", "one")
    rig.run(0.1)
    assert rig.events[1:] == [(f"next-{MOST_WAITING}", "dropped")]


def test_a_text_without_end_is_cut(rig: VoiceRig) -> None:
    rig.say("endless", "seven words that never come to an end " * 100)
    rig.run_until("endless", "finished", at_most_s=60.0)


@pytest.mark.parametrize("message", [{}, {"text": "  "}, {"text": 7}])
def test_what_has_no_words_fails_with_the_reason(rig: VoiceRig, message: dict[str, Any]) -> None:
    rig.publish({"say_id": "x", **message})
    rig.run(0.1)
    assert rig.events == [("x", "failed")]
    assert "text: expected words" in rig.reasons["x"]


def test_without_an_engine_everything_fails_with_the_remedy(
    make_rig: Callable[..., VoiceRig],
) -> None:
    rig = make_rig(EspeakEngine(program="no-such-espeak"))
    assert rig.voice.document()["state"] == "missing"
    rig.say("a")
    rig.run(0.2)
    assert rig.events == [("a", "failed")]
    assert "apt install espeak-ng" in rig.reasons["a"]
