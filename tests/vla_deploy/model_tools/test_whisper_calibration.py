"""How sure a model's words are is learnt from recordings whose words are known."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.wav import WavOutput
from drivers.clock import MonotonicClock
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.manifest_file import read_manifest
from vla_deploy.inference.store import ModelStore
from vla_deploy.model_tools.whisper_calibration import calibrate, keep, known_recordings, learn
from vla_deploy.model_tools.whispers import PLAIN_CHOICE
from vla_deploy.speech.errors import RecordingsInvalid
from vla_deploy.speech.transcript import Transcript, confidence

READING = Transcript(
    text="turn left",
    log_probability=-0.1,
    no_speech=0.0,
    compression=1.0,
    language="en",
)


def drawn(count: int) -> tuple[list[Transcript], list[bool]]:
    """Return readings that are right where their log-probability is above about -0.3."""
    draw = np.random.default_rng(4)
    values = -0.6 * draw.random(count)
    chances = 1.0 / (1.0 + np.exp(-25.0 * (values + 0.3)))
    readings = [replace(READING, log_probability=float(value)) for value in values]
    return readings, [bool(draw.random() < chance) for chance in chances]


def test_the_confidence_becomes_the_share_that_is_right() -> None:
    readings, right = drawn(3_000)
    done = learn(readings, right)
    assert done.error_after < 0.6 * done.error_before
    sure = [confidence(reading, done.calibration) for reading in readings]
    for low in (0.0, 0.2, 0.4, 0.6, 0.8):
        chosen = [
            is_right for one, is_right in zip(sure, right, strict=True) if low <= one < low + 0.2
        ]
        assert np.mean(chosen) == pytest.approx(low + 0.1, abs=0.1)


def test_a_few_perfect_recordings_do_not_make_it_sure_of_everything() -> None:
    done = learn(20 * [READING], 20 * [True])
    assert confidence(READING, done.calibration) > 0.9
    assert confidence(replace(READING, log_probability=-2.0), done.calibration) < 0.1


def test_readings_without_words_teach_nothing() -> None:
    readings, right = drawn(100)
    silent = 50 * [replace(READING, text="")]
    with_silence = learn([*readings, *silent], [*right, *(50 * [False])])
    assert with_silence.calibration == learn(readings, right).calibration


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    folder = tmp_path / "recordings"
    folder.mkdir()
    for number in range(20):
        file = WavOutput(folder / f"{number:02}.wav", AudioFormat(rate_hz=16_000))
        file.write(np.zeros((8_000, 1), np.int16))
        file.close()
        words = "Turn left." if number % 2 else ""
        (folder / f"{number:02}.txt").write_text(words)
    return folder


def test_recordings_teach_an_added_model_which_keeps_it(
    scripted_whisper: Any, recordings: Path
) -> None:
    folder = scripted_whisper.model("ours", "turn left")
    model = ModelStore(folder.parent, embedded=folder / "none").load("ours")
    known = known_recordings(recordings)
    done = calibrate(model, PLAIN_CHOICE, known, beam=1, clock=MonotonicClock())
    assert (done.recordings, done.right) == (20, 10)
    assert done.error_after < done.error_before
    keep(model, done.calibration)
    whisper = read_manifest(folder).whisper
    assert whisper is not None
    assert whisper.calibration == done.calibration
    with pytest.raises(ModelUnknown, match="was not added"):
        keep(replace(model, is_embedded=True), done.calibration)


def test_recordings_without_their_words_are_refused(recordings: Path) -> None:
    (recordings / "03.txt").unlink()
    with pytest.raises(RecordingsInvalid, match=r"without words: \['03\.wav'\]"):
        known_recordings(recordings)
