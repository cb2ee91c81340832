"""Hold a piece of sound, read one from a program, bring it to the rate of a speaker or a room."""

import io
import math
import struct
import wave
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.audio.base import FULL_SCALE, AudioFormat, Samples
from drivers.errors import VoiceError

Wave = NDArray[np.float32]
"""Samples of one channel as a share of full scale, -1 to 1."""
# Silence behind the sound: the transform is a circle, and the end must not ring into the beginning.
_APART_ROWS: Final = 256
_MONO_16_BIT: Final = (2, 1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Clip:
    """Hold a sound of one channel."""

    rate_hz: int
    wave: Wave

    @property
    def duration_s(self) -> float:
        """Return how long it lasts."""
        return len(self.wave) / self.rate_hz

    def at_rate(self, rate_hz: int) -> "Clip":
        """Return the same sound at another rate, without what the lower of both cannot carry."""
        if rate_hz == self.rate_hz:
            return self
        shared = math.gcd(rate_hz, self.rate_hz)
        step, new_step = self.rate_hz // shared, rate_hz // shared
        blocks = math.ceil((len(self.wave) + _APART_ROWS) / step)
        spectrum = np.fft.rfft(self.wave, blocks * step)
        resampled = np.fft.irfft(spectrum, blocks * new_step) * (new_step / step)
        kept = math.ceil(len(self.wave) * new_step / step)
        return Clip(rate_hz=rate_hz, wave=resampled[:kept].astype(np.float32))

    def samples(self, format_: AudioFormat, volume_ratio: float) -> Samples:
        """Return it as a device of this format plays it, the same on every channel."""
        wave = self.at_rate(format_.rate_hz).wave * np.float32(volume_ratio * FULL_SCALE)
        mono = np.rint(wave).clip(-FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
        return np.repeat(mono[:, None], format_.channels, axis=1)


def read_wav_stream(data: bytes) -> Clip:
    """Return the sound of a WAV from a pipe: to the end of what is there, as its header knows none.

    Raises:
        VoiceError: it is no WAV of 16-bit samples of one channel, or has none.
    """
    try:
        told = data[:4] + struct.pack("<I", len(data)) + data[8:]
        with wave.open(io.BytesIO(told)) as sound:
            form = sound.getsampwidth(), sound.getnchannels()
            rate_hz, rows = sound.getframerate(), sound.readframes(len(data))
    except (wave.Error, EOFError) as error:
        raise VoiceError(f"expected a WAV, got {data[:12]!r}: {error}") from error
    samples = np.frombuffer(rows[: len(rows) // 2 * 2], "<i2")
    if form != _MONO_16_BIT or not len(samples):
        raise VoiceError(
            f"expected 16-bit samples of one channel, got {len(samples)} samples of "
            f"{8 * form[0]} bits on {form[1]} channels"
        )
    return Clip(rate_hz=rate_hz, wave=(samples / 32_768.0).astype(np.float32))
