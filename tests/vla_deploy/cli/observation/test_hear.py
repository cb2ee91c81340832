"""`vla-deploy hear` tells what the robot would understand of a recording, and needs no robot."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.wav import WavOutput
from sim_twin.sound.acoustics import Acoustics
from sim_twin.sound.talker import Talker, arrival
from vla_deploy.runtime.state_dir import models_dir_of

Hear = Callable[..., tuple[int, str, str]]


@pytest.fixture
def hear(vla: Hear, base: Path, scripted_whisper: Any) -> Hear:
    models = models_dir_of(base)
    models.parent.mkdir(parents=True, exist_ok=True)
    scripted_whisper.model("says-left", "turn left")
    models.symlink_to(scripted_whisper.folder)
    return partial(vla, "hear")


@pytest.fixture
def recording(tmp_path: Path) -> str:
    path = tmp_path / "two.wav"
    file = WavOutput(path, AudioFormat(rate_hz=48_000, channels=2))
    for text in ("turn left", "come back to me"):
        wave = arrival(text, Talker(), 48_000, Acoustics()).sound.wave
        samples = np.concatenate((wave, np.zeros(48_000, np.float32)))
        file.write(np.repeat((32_768 * samples).astype(np.int16)[:, None], 2, axis=1))
    file.close()
    return str(path)


def test_each_phrase_of_a_recording_is_told_with_times_and_verdict(
    hear: Hear, recording: str
) -> None:
    code, out, _ = hear(recording, "--model", "says-left", "--json")
    phrases = json.loads(out)
    assert (code, [one["text"] for one in phrases]) == (0, ["turn left", "turn left"])
    assert {one["verdict"] for one in phrases} == {"accepted"}
    assert 0 < phrases[0]["began_s"] < phrases[0]["ended_s"] < phrases[1]["began_s"]
    assert phrases[0]["confidence"] > 0.8
    assert "accepted" in hear(recording, "--model", "says-left")[1]


def test_silence_says_nothing_and_faults_are_one_line(hear: Hear, tmp_path: Path) -> None:
    path = tmp_path / "silence.wav"
    file = WavOutput(path, AudioFormat(rate_hz=16_000))
    file.write(np.zeros((32_000, 1), np.int16))
    file.close()
    assert hear(str(path), "--model", "says-left", "--json")[1] == "[]\n"
    assert "nobody speaks" in hear(str(path), "--model", "says-left")[1]
    code, _, errors = hear(str(tmp_path / "none.wav"), "--model", "says-left")
    assert code == 2
    assert "no such file" in errors
    code, _, errors = hear(str(path), "--model", "unheard-of")
    assert code == 2
    assert "unheard-of is not here" in errors


@pytest.mark.parametrize(
    ("at", "value", "length", "complaint"),
    [
        (24, 1, None, "no WAV file"),  # its rate
        (22, 64, None, "no WAV file"),  # its channels
        (22, 2, 30, "(cut off)"),
    ],
)
def test_a_recording_that_no_microphone_makes_is_refused_in_one_line(
    hear: Hear, recording: str, at: int, value: int, length: int | None, complaint: str
) -> None:
    content = bytearray(Path(recording).read_bytes())
    content[at : at + 2] = value.to_bytes(2, "little")
    Path(recording).write_bytes(content[:length])
    code, _, errors = hear(recording, "--model", "says-left")
    assert code == 2
    assert complaint in errors
    assert len(errors.splitlines()) == 1
