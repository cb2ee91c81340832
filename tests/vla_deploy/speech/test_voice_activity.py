"""The voice network says of a stream what it says of a recording."""

import sys

import numpy as np
import pytest

from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.sound import FRAME
from vla_deploy.speech.voice_activity import open_voice_activity


def test_a_stream_gives_bit_for_bit_what_the_library_says_of_the_whole() -> None:
    from faster_whisper.vad import get_vad_model

    sound = np.random.default_rng(3).standard_normal(60 * FRAME).astype(np.float32) * 0.1
    sound *= np.abs(np.sin(np.arange(len(sound)) / 3_000)).astype(np.float32)
    activity = open_voice_activity()
    frames = sound.reshape(-1, FRAME)
    streamed = [activity.probability(frame) for frame in frames]
    whole = get_vad_model()(sound.copy())  # which silences the end of its last frame
    assert np.array_equal(np.array(streamed[:-1], np.float32), whole[:-1])
    activity.reset()
    assert activity.probability(frames[0]) == streamed[0]


def test_a_missing_package_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "faster_whisper", raising=False)
    monkeypatch.setattr(sys, "path", [])
    with pytest.raises(SpeechMissing, match="typed commands go on"):
        open_voice_activity()
