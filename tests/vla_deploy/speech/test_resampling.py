"""Sound of any rate and any number of channels becomes one channel at 16 kHz, block by block."""

import sys
from collections.abc import Callable

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, Samples
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.microphone import Resampler
from vla_deploy.speech.sound import Sound, level_db

Tone = Callable[..., Samples]


def in_blocks(format_: AudioFormat, samples: Samples, size: int) -> Sound:
    resampler = Resampler(format_)
    parts = [resampler.feed(samples[at : at + size]) for at in range(0, len(samples), size)]
    return np.concatenate(parts)


@pytest.mark.parametrize("rate_hz", [8_000, 44_100, 48_000])
@pytest.mark.parametrize("channels", [1, 2, 6])
def test_a_tone_keeps_pitch_level_and_time_whatever_the_blocks(
    tone: Tone, rate_hz: int, channels: int
) -> None:
    samples = np.repeat(tone(1.0, rate_hz=rate_hz), channels, axis=1)
    heard = in_blocks(AudioFormat(rate_hz=rate_hz, channels=channels), samples, rate_hz // 73)
    assert 15_900 <= len(heard) <= 16_000
    wanted = tone(1.0)[: len(heard), 0] / 32_768
    assert np.abs(heard - wanted)[100:-100].max() < 2e-3


def test_what_is_above_the_new_bandwidth_does_not_fold_back_into_it(tone: Tone) -> None:
    samples = np.repeat(tone(0.5, hz=10_000, rate_hz=48_000), 2, axis=1)
    heard = in_blocks(AudioFormat(rate_hz=48_000, channels=2), samples, 960)
    assert level_db(heard[100:-100]) < -80


def test_16_khz_is_handed_on_as_it_is_and_needs_no_library(
    tone: Tone, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    heard = Resampler(AudioFormat(rate_hz=16_000)).feed(tone(0.1))
    assert np.array_equal(heard, tone(0.1)[:, 0].astype(np.float32) / 32_768)
    with pytest.raises(SpeechMissing, match=r"pip install 'vla-deploy\[speech\]'"):
        Resampler(AudioFormat(rate_hz=48_000))
