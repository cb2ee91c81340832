"""Bring a microphone's samples, whatever their rate and channels, to one channel at 16 kHz."""

from importlib import import_module
from typing import Any, Final

import numpy as np

from drivers.audio.base import FULL_SCALE, AudioFormat, Samples
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.sound import RATE_HZ, Sound

_MONO: Final = {"format": "flt", "layout": "mono"}


class Resampler:
    """Convert a stream block by block; what the filter still holds comes with the next block.

    Channels are averaged, then FFmpeg's resampler changes the rate: it lets through nothing above
    half of 16 kHz, and adds no delay.
    """

    def __init__(self, format_: AudioFormat) -> None:
        """Prepare for one format.

        Raises:
            SpeechMissing: the rate is another one than 16 kHz, and PyAV is not installed.
        """
        self._rate_hz = format_.rate_hz
        self._av: Any = None if format_.rate_hz == RATE_HZ else _av()
        self._resampler: Any = None
        self.reset()

    def reset(self) -> None:
        """Forget what came before: the next block does not continue it."""
        if self._av is not None:
            self._resampler = self._av.AudioResampler(**_MONO, rate=RATE_HZ)

    def feed(self, samples: Samples) -> Sound:
        """Return what a block, (n, channels), makes at 16 kHz; it may be a little or nothing."""
        mono: Sound = samples.mean(axis=1, dtype=np.float32) / np.float32(FULL_SCALE)
        if self._resampler is None or not len(mono):
            return mono
        return self._converted(mono)

    def _converted(self, mono: Sound) -> Sound:
        frame = self._av.AudioFrame.from_ndarray(mono[None], **_MONO)
        frame.sample_rate = self._rate_hz
        parts = [one.to_ndarray()[0] for one in self._resampler.resample(frame)]
        return np.concatenate(parts, dtype=np.float32) if parts else np.zeros(0, np.float32)


def _av() -> Any:
    try:
        return import_module("av")
    except ImportError as error:
        raise SpeechMissing(
            "sound of another rate than 16 kHz needs PyAV: pip install 'vla-deploy[speech]'"
        ) from error
