"""The robot does not hear itself, and a person may speak into what it says."""

import numpy as np
import pytest

from vla_deploy.speech.companions import Playing
from vla_deploy.speech.echo_gate import BARGE_FRAMES, EchoGate

SAYING = Playing(say_id="s", text="I am on my way", level_db=-20.0)


def speak(gate: EchoGate, frames: int, level_db: float, voice: float = 0.98) -> int:
    """Let the robot say something for so many frames; return in how many a person was heard."""
    persons = 0
    for _ in range(frames):
        gate.follow(SAYING)
        persons += gate.is_shut and gate.is_person(level_db, voice)
    return persons


def test_its_own_voice_is_no_persons_whatever_the_network_says() -> None:
    gate = EchoGate()
    draw = np.random.default_rng(5)
    played = -20.0 - 25.0 * draw.random(300) ** 3  # words, and the gaps between them
    for number, level_db in enumerate(played):
        gate.follow(Playing(say_id="s", text="I am on my way", level_db=level_db))
        echo_db = played[max(0, number - 3)] - 18.0
        assert not gate.is_person(echo_db, 0.99)
        assert not gate.barges_in()
    assert gate.coupling_db == pytest.approx(-18.0, abs=1.0)


def test_the_loudness_of_its_echo_is_learnt_quickly_down_and_slowly_up() -> None:
    gate = EchoGate()
    speak(gate, 60, -38.0)
    assert abs(gate.coupling_db - -18.0) < 0.5
    speak(gate, 15, -20.0)
    assert gate.coupling_db < -17.0, "half a second of a loud person is not taken for the echo"


def test_a_person_who_is_louder_than_the_echo_barges_in_once() -> None:
    gate = EchoGate()
    speak(gate, 60, -38.0)
    assert speak(gate, BARGE_FRAMES - 1, -28.0) == BARGE_FRAMES - 1
    assert not gate.barges_in()
    assert speak(gate, 1, -28.0) == 1
    assert gate.barges_in()
    assert not gate.barges_in()
    assert not gate.is_shut, "everything is heard from now on"
    gate.follow(SAYING)
    assert not gate.is_shut
    gate.follow(None)
    gate.follow(SAYING)
    assert gate.is_shut, "until the robot speaks again"


def test_a_loud_sound_that_is_no_voice_does_not_barge_in() -> None:
    gate = EchoGate()
    speak(gate, 60, -38.0)
    assert speak(gate, 20, -10.0, voice=0.4) == 0
    assert not gate.barges_in()


def test_the_gate_is_open_while_the_robot_is_silent() -> None:
    gate = EchoGate()
    gate.follow(None)
    assert not gate.is_shut
