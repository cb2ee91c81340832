"""Turn sound into log-mel frames, piece by piece as it arrives.

Training computes its features with this very code. Whatever the pieces, the frames are the same.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vla_deploy.speech.sound import RATE_HZ, Sound

Frames = NDArray[np.float32]

NAME: Final = "log_mel_40"
HOP: Final = 160
WINDOW: Final = 400
BANDS: Final = 40
STRIDE: Final = 2
"""Frames per moment that the network judges."""
_FFT: Final = 512
_LOW_HZ, _HIGH_HZ = 80.0, 7_600.0
_FLOOR: Final = np.float32(1e-6)
_CENTRE, SPREAD = np.float32(-4.0), np.float32(4.0)
"""A value is the logarithm of a band's power, less the one and divided by the other."""


class LogMelStream:
    """Give a frame of `BANDS` values for each hundredth of a second of sound."""

    def __init__(self) -> None:
        self._rest: Sound = np.zeros(0, np.float32)

    @property
    def waiting(self) -> int:
        """Return how many samples the newest frame does not reach."""
        return max(0, len(self._rest) - (WINDOW - HOP))

    def feed(self, sound: Sound) -> Frames:
        """Return the frames that have become whole, of shape (n, `BANDS`).

        `sound` is mono at 16 kHz, as a share of full scale.
        """
        held = np.concatenate([self._rest, sound.astype(np.float32, copy=False)])
        count = max(0, (len(held) - WINDOW) // HOP + 1)
        self._rest = held[count * HOP :]
        if not count:
            return np.zeros((0, BANDS), np.float32)
        windows = np.lib.stride_tricks.sliding_window_view(held, WINDOW)[::HOP][:count]
        return _log_mel(windows)


def log_mel(sound: Sound) -> Frames:
    """Return the frames of a whole piece of sound, of shape (n, `BANDS`)."""
    return LogMelStream().feed(sound)


def silence(count: int) -> Frames:
    """Return the frames of digital silence."""
    return np.full((count, BANDS), (np.log(_FLOOR) - _CENTRE) / SPREAD, np.float32)


def _log_mel(windows: Sound) -> Frames:
    spectrum = np.fft.rfft(windows * _HANN, _FFT)
    power = (spectrum.real**2 + spectrum.imag**2).astype(np.float32)
    frames: Frames = (np.log(power @ _MEL + _FLOOR) - _CENTRE) / SPREAD
    return frames


def _mel_of(hz: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(2_595.0 * np.log10(1.0 + np.asarray(hz) / 700.0))


def _mel_matrix() -> NDArray[np.float32]:
    """Return triangles that are equally wide in mel, of shape (bins, `BANDS`)."""
    bins = _mel_of(np.fft.rfftfreq(_FFT, 1.0 / RATE_HZ))
    low, middle, high = _EDGES[:-2], _EDGES[1:-1], _EDGES[2:]
    up = (bins[:, None] - low) / (middle - low)
    down = (high - bins[:, None]) / (high - middle)
    return np.clip(np.minimum(up, down), 0.0, None).astype(np.float32)


_EDGES: Final = np.linspace(_mel_of(_LOW_HZ), _mel_of(_HIGH_HZ), BANDS + 2)
BAND_HZ: Final = 700.0 * (10.0 ** (_EDGES[1:-1] / 2_595.0) - 1.0)
"""The middle of each band."""
_HANN: Final = np.hanning(WINDOW).astype(np.float32)
_MEL: Final = _mel_matrix()
