"""The room's noise is followed, and music is told from noise and from speech."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from vla_deploy.speech.sound import Sound, level_db
from vla_deploy.speech.surroundings import Music, NoiseFloor
from vla_deploy.speech.voice_activity import FRAME, FRAME_S


def frames(sound: Sound) -> Iterator[Sound]:
    yield from sound[: len(sound) // FRAME * FRAME].reshape(-1, FRAME)


def settle(floor: NoiseFloor, level: float, seconds: float, *, is_voice: bool = False) -> float:
    for _ in range(round(seconds / FRAME_S)):
        floor.note(level, is_voice=is_voice)
    return floor.level_db


def test_the_floor_falls_at_once_and_rises_over_seconds() -> None:
    floor = NoiseFloor()
    assert settle(floor, -75.0, 1.0) == pytest.approx(-75.0)
    assert settle(floor, -45.0, 1.0) == pytest.approx(-72.0, abs=0.2)
    assert settle(floor, -45.0, 12.0) == pytest.approx(-45.0)


def test_an_offset_of_the_microphone_is_no_sound() -> None:
    noise = 0.001 * np.random.default_rng(1).standard_normal(FRAME).astype(np.float32)
    assert level_db(noise + np.float32(0.1)) == pytest.approx(level_db(noise), abs=0.01)
    assert level_db(noise) == pytest.approx(-60.0, abs=1.0)


def test_a_voice_is_no_floor() -> None:
    floor = NoiseFloor()
    settle(floor, -70.0, 1.0)
    assert settle(floor, -25.0, 20.0, is_voice=True) == pytest.approx(-70.0)


def chord(seconds: float) -> Sound:
    time_s = np.arange(round(seconds * 16_000)) / 16_000
    beat = 0.6 + 0.4 * np.sign(np.sin(2 * np.pi * 2 * time_s))
    tones = sum(np.sin(2 * np.pi * hz * time_s) for hz in (220, 277, 330, 440))
    return (0.05 * beat * tones).astype(np.float32)


@pytest.mark.parametrize(
    ("name", "voice", "plays"),
    [("chord", 0.1, True), ("noise", 0.1, False), ("chord", 0.9, False), ("silence", 0.0, False)],
)
def test_music_is_a_steady_pitch_without_a_voice(name: str, voice: float, plays: bool) -> None:
    noise = 0.05 * np.random.default_rng(1).standard_normal(160_000).astype(np.float32)
    sounds: dict[str, Any] = {"chord": chord(10.0), "noise": noise, "silence": 0 * noise}
    music = Music()
    for frame in frames(sounds[name]):
        music.note(frame, level_db(frame), voice)
    assert music.plays is plays
