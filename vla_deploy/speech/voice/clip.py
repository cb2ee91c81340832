"""Hold a piece of sound, read one from a program, bring it to the rate of a speaker or a room."""

import io
import math
import struct
import wave
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.audio.base import FULL_SCALE, AudioFormat, Samples
from vla_deploy.speech.errors import SynthesisFailed

Wave = NDArray[np.float32]
"""Samples of one channel as a share of full scale, -1 to 1."""
# Silence behind the sound: the transform is a circle, and the end must not ring into the beginning.
_APART_ROWS: Final = 256
_BITS: Final = 16


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
        padded = np.zeros(blocks * step, np.float32)
        padded[: len(self.wave)] = self.wave
        rows = blocks * new_step
        resampled = np.fft.irfft(_cut(np.fft.rfft(padded), rows), rows) * (new_step / step)
        kept = math.ceil(len(self.wave) * new_step / step)
        return Clip(rate_hz=rate_hz, wave=resampled[:kept].astype(np.float32))

    def samples(self, format_: AudioFormat, volume_ratio: float) -> Samples:
        """Return it as a device of this format plays it, the same on every channel."""
        wave = self.at_rate(format_.rate_hz).wave * np.float32(volume_ratio * FULL_SCALE)
        mono = np.rint(wave).clip(-FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
        return np.repeat(mono[:, None], format_.channels, axis=1)


def _cut(spectrum: NDArray[np.complexfloating[Any, Any]], rows: int) -> NDArray[np.complex128]:
    """Return a spectrum as long as that of `rows` samples: shortened, or filled with nothing."""
    wanted = rows // 2 + 1
    fitted = np.zeros(wanted, np.complex128)
    kept = min(wanted, len(spectrum))
    fitted[:kept] = spectrum[:kept]
    return fitted


def read_wav_stream(data: bytes) -> Clip:
    """Return the sound of a WAV from a pipe: to the end of what is there, as its header knows none.

    Raises:
        SynthesisFailed: it is no WAV of 16-bit samples, or has none.
    """
    try:
        told = data[:4] + struct.pack("<I", len(data)) + data[8:]
        with wave.open(io.BytesIO(told)) as sound:
            bits, channels, rate_hz = (
                8 * sound.getsampwidth(),
                sound.getnchannels(),
                sound.getframerate(),
            )
            rows = sound.readframes(len(data))
    except (wave.Error, EOFError) as error:
        raise SynthesisFailed(f"expected a WAV, got {data[:12]!r}: {error}") from error
    if bits != _BITS:
        raise SynthesisFailed(f"expected PCM of {_BITS} bits, got {bits} bits")
    return Clip(rate_hz=rate_hz, wave=pcm_wave(rows, channels))


def pcm_wave(data: bytes, channels: int = 1) -> Wave:
    """Return 16-bit little-endian samples as one wave, the mean of the channels.

    Raises:
        SynthesisFailed: there is not one whole row.
    """
    row_bytes = 2 * channels
    whole = len(data) - len(data) % row_bytes
    if not whole:
        raise SynthesisFailed("expected sound, got no sample")
    rows = np.frombuffer(data[:whole], "<i2").reshape(-1, channels)
    wave: Wave = (rows.mean(axis=1) / 32_768.0).astype(np.float32)
    return wave
