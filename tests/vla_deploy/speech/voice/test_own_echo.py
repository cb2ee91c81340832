"""The robot's own voice in the twin's room is taken out; what a person says into it is left."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest

from drivers.audio.clip import Wave
from drivers.audio.espeak import EspeakEngine
from sim_twin.sound.acoustics import Acoustics, path, through
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.speech.sound import FRAME, RATE_HZ, SoundBlock, duration_ns, level_db
from vla_deploy.speech.voice.own_echo import OwnEcho

ROOM = Acoustics()
SENTENCES = ("I have put the red cup into the box", "now I go back to the kitchen table")


@cache
def spoken(text: str) -> Wave:
    return EspeakEngine().synthesise(text).at_rate(RATE_HZ).wave * np.float32(0.8)


def echo_of(wave: Wave, late_rows: int = 0) -> Wave:
    response = ROOM.speaker_gain * path(ROOM.speaker_distance_m, RATE_HZ, ROOM, 0)
    late = np.zeros(480 + late_rows, np.float32)
    return np.concatenate((late, through(wave, response))).astype(np.float32)


class Ear:
    """Let a robot that speaks hear itself."""

    def __init__(self) -> None:
        self.echo = OwnEcho()
        self.now_ns = 10**9
        self.frames = self.louder = 0
        self._random = np.random.default_rng(0)

    def speak(self, wave: Wave, heard: Wave) -> Wave:
        """Play `wave` while `heard` arrives; return what remains of it."""
        zero_ns = self.now_ns
        parts: list[Wave] = []
        rows = -(-(len(heard) + RATE_HZ) // FRAME) * FRAME
        noisy = self._random.standard_normal(rows) * 12 / 32_768
        noisy[: len(heard)] += heard
        for at in range(0, rows, FRAME):
            until = min(len(wave), at + 2_400)
            self.echo.note(wave, zero_ns, zero_ns + duration_ns(until))
            frame = SoundBlock(
                stamp_ns=zero_ns + duration_ns(at),
                samples=noisy[at : at + FRAME].astype(np.float32),
                follows=at > 0,
            )
            cleaned = self.echo.clean(frame)
            assert cleaned.stamp_ns == frame.stamp_ns
            parts.append(cleaned.samples)
            self.frames += 1
            self.louder += level_db(cleaned.samples) > max(self.echo.left_db, -65.0)
        self.now_ns = zero_ns + duration_ns(rows)
        return np.concatenate(parts)


@pytest.fixture(scope="module")
def learnt() -> Ear:
    """Return an ear that has heard itself say both sentences."""
    ear = Ear()
    for sentence in SENTENCES:
        ear.speak(spoken(sentence), echo_of(spoken(sentence)))
    return ear


@pytest.fixture
def ear(learnt: Ear) -> Ear:
    return deepcopy(learnt)


def weaker_db(before: Wave, after: Wave) -> float:
    return float(10 * np.log10(np.mean(before**2) / np.mean(after[: len(before)] ** 2)))


def test_an_echo_is_learnt_and_from_then_on_taken_out() -> None:
    ear = Ear()
    reductions = []
    for sentence in (*SENTENCES, *SENTENCES):
        wave = spoken(sentence)
        reductions.append(weaker_db(echo_of(wave), ear.speak(wave, echo_of(wave))))
    assert reductions[0] > 3.0
    assert min(reductions[2:]) > 10.0


def test_what_a_person_says_into_it_stands_out(ear: Ear) -> None:
    wave = spoken(SENTENCES[0])
    heard = echo_of(wave)
    person = arrival("robot stop", Talker(), RATE_HZ, ROOM).sound.wave
    at = RATE_HZ
    heard[at : at + len(person)] += person[: len(heard) - at]
    rest = ear.speak(wave, heard)[at : at + len(person)]
    spoilt = heard[at : at + len(person)] - person
    assert weaker_db(person, spoilt) < -3.0
    assert weaker_db(person, rest - person) > weaker_db(person, spoilt) + 7.0


@pytest.mark.parametrize("late_rows", [0, 3, 40, 160, 2_400])
def test_what_is_left_of_the_echo_is_never_louder_than_told(ear: Ear, late_rows: int) -> None:
    ear.louder = 0
    for sentence in SENTENCES:
        ear.speak(spoken(sentence), echo_of(spoken(sentence), late_rows))
    assert ear.louder < 0.03 * ear.frames


def test_while_the_robot_is_silent_everything_passes_as_it_is() -> None:
    echo = OwnEcho()
    frame = SoundBlock(stamp_ns=10**9, samples=np.ones(FRAME, np.float32))
    assert echo.clean(frame) is frame


def test_a_sound_that_is_no_echo_passes_while_the_robot_speaks(ear: Ear) -> None:
    for sentence in SENTENCES:
        ear.speak(spoken(sentence), echo_of(spoken(sentence)))
    wave = spoken(SENTENCES[0])
    echo = echo_of(wave)
    alarm = 0.1 * np.sin(2 * np.pi * 800 * np.arange(len(echo)) / RATE_HZ).astype(np.float32)
    alarm[: RATE_HZ // 2] = 0.0
    rest = ear.speak(wave, echo + alarm)
    assert weaker_db(alarm, rest) == pytest.approx(0.0, abs=1.5)
