"""Frames are those of training, whatever the pieces that sound arrives in."""

import numpy as np
import pytest

from vla_deploy.speech.sound import RATE_HZ, Sound
from vla_deploy.speech.stop_words import features


def chirp(duration_s: float = 0.7) -> Sound:
    times_s = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    return (0.1 * np.sin(2 * np.pi * (300.0 + 2_000.0 * times_s) * times_s)).astype(np.float32)


@pytest.mark.parametrize("piece", [1, 159, 160, 320, 401, 4_096])
def test_pieces_of_any_size_give_the_frames_of_the_whole(piece: int) -> None:
    sound, stream = chirp(0.2), features.LogMelStream()
    parts = [stream.feed(sound[at : at + piece]) for at in range(0, len(sound), piece)]
    assert np.allclose(np.concatenate(parts), features.log_mel(sound), rtol=0.0, atol=1e-5)


def test_a_frame_comes_for_each_hundredth_of_a_second_that_is_whole() -> None:
    frames = features.log_mel(chirp(0.5))
    assert frames.shape == (1 + (RATE_HZ // 2 - features.WINDOW) // features.HOP, features.BANDS)


def test_a_tone_is_loudest_in_its_own_band() -> None:
    times_s = np.arange(RATE_HZ // 4) / RATE_HZ
    bands = [
        int(features.log_mel(np.sin(2 * np.pi * hz * times_s).astype(np.float32))[5].argmax())
        for hz in (200.0, 800.0, 3_000.0, 7_000.0)
    ]
    assert bands == sorted(bands)
    assert len(set(bands)) == 4


def test_nothing_sounds_like_digital_silence() -> None:
    frames = features.log_mel(np.zeros(RATE_HZ // 2, np.float32))
    assert np.allclose(frames, features.silence(len(frames)))


def test_what_waits_for_the_next_frame_is_counted() -> None:
    stream = features.LogMelStream()
    stream.feed(np.zeros(features.WINDOW + 70, np.float32))
    assert stream.waiting == 70
