"""The robot does not hear itself, and a person may speak into what it says."""

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.speech.echo_gate import BARGE_FRAMES, OUTLASTS_NS, EchoGate
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.sound import NOTHING, Playing

SAYING = Playing(say_id="s", text="I am on my way", echo_db=-38.0)
DIED_NS = NS_PER_S


def speak(gate: EchoGate, frames: int, level_db: float, voice: float = 0.98) -> int:
    """Let the robot say something for so many frames; return in how many a person was heard."""
    persons = 0
    for _ in range(frames):
        gate.follow(SAYING, DIED_NS)
        persons += gate.is_shut and gate.is_person(level_db, voice)
    return persons


def phrase(ended_ns: int) -> Phrase:
    return Phrase(
        number=1,
        began_ns=0,
        ended_ns=ended_ns,
        voiced_s=1.0,
        clipped_ratio=0.0,
        voice=0.9,
        samples=NOTHING,
    )


def test_its_own_voice_is_no_persons_whatever_the_network_says() -> None:
    gate = EchoGate()
    draw = np.random.default_rng(5)
    for echo_db in -38.0 - 25.0 * draw.random(300) ** 3:  # words, and the gaps between them
        gate.follow(Playing(say_id="s", text="I am on my way", echo_db=echo_db), DIED_NS)
        assert not gate.is_person(echo_db - 1.0, 0.99)
        assert not gate.barges_in()


def test_a_person_who_is_louder_than_the_echo_barges_in_once() -> None:
    gate = EchoGate()
    assert speak(gate, BARGE_FRAMES - 1, -28.0) == BARGE_FRAMES - 1
    assert not gate.barges_in()
    assert speak(gate, 1, -28.0) == 1
    assert gate.barges_in()
    assert not gate.barges_in()
    assert not gate.is_shut, "everything is heard from now on"
    gate.follow(SAYING, DIED_NS)
    assert not gate.is_shut
    gate.follow(None, DIED_NS)
    gate.follow(SAYING, DIED_NS)
    assert gate.is_shut, "until the robot speaks again"


def test_a_loud_sound_that_is_no_voice_does_not_barge_in() -> None:
    gate = EchoGate()
    assert speak(gate, 20, -10.0, voice=0.4) == 0
    assert not gate.barges_in()


def test_the_gate_is_open_while_the_robot_is_silent() -> None:
    gate = EchoGate()
    gate.follow(None, DIED_NS)
    assert not gate.is_shut


@pytest.fixture
def sounding() -> EchoGate:
    """Let the robot sound until `DIED_NS`."""
    gate = EchoGate()
    gate.follow(SAYING, DIED_NS)
    return gate


def test_what_begins_while_the_robot_sounds_may_be_its_own(sounding: EchoGate) -> None:
    sounding.note_begun()
    sounding.follow(None, 2 * DIED_NS)
    assert sounding.own_words(phrase(DIED_NS)) == SAYING.text
    assert sounding.own_words(phrase(DIED_NS + OUTLASTS_NS)) == SAYING.text


def test_whoever_goes_on_when_the_robot_has_ended_is_a_person(sounding: EchoGate) -> None:
    sounding.note_begun()
    sounding.follow(None, 2 * DIED_NS)
    assert sounding.own_words(phrase(DIED_NS + OUTLASTS_NS + 1)) == ""


def test_what_begins_after_the_robots_sound_is_a_persons(sounding: EchoGate) -> None:
    sounding.follow(None, DIED_NS + 1)
    sounding.note_begun()
    assert sounding.own_words(phrase(DIED_NS)) == ""


def test_whoever_has_barged_in_is_a_person_from_the_first_word_on(sounding: EchoGate) -> None:
    sounding.note_begun()
    speak(sounding, BARGE_FRAMES, -10.0)
    assert sounding.barges_in()
    assert sounding.own_words(phrase(DIED_NS)) == ""
    sounding.note_begun()
    assert sounding.own_words(phrase(DIED_NS)) == ""
