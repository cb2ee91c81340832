"""Take out of a microphone's sound what a known sound makes of it on its way through the room.

A partitioned-block adaptive filter in the frequency domain with a Kalman gain (Enzner and Vary,
"Frequency-domain adaptive Kalman filter for acoustic echo control", Signal Processing 86, 2006; its
partitioned form: Kuech, Mabande, Enzner, ICASSP 2014). The gain follows from how unsure each tap is
and how loud everything else is, so a person who speaks into the echo does not lead it astray. The
same doubt says how much of the echo may be left.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.speech.voice.clip import Wave

BLOCK: Final = 256
PARTITIONS: Final = 16
_FORGETTING: Final = 0.999
_FIRST_DOUBT: Final = 1.0
_NEW_DOUBT: Final = 0.3
_CONFIRMED_DOUBT: Final = 0.03
_CONFIRMED_SHARE: Final = 0.4  # what is left is less than the bound by as much, 99 times of 100
_REST_SMOOTHING: Final = 0.8
_TINY: Final = 1e-9


class EchoFilter:
    """Learn one path of up to 4096 samples; feed blocks of 256 that follow each other."""

    def __init__(self) -> None:
        self.left_power = 0.0
        """What of the echo may be left in the newest block at most: mean square of a sample."""
        bins = BLOCK + 1
        self._known = np.zeros(2 * BLOCK)
        self._spectra = np.zeros((PARTITIONS, bins), np.complex128)
        self._path = np.zeros((PARTITIONS, bins), np.complex128)
        self._doubt = np.full((PARTITIONS, bins), _FIRST_DOUBT)
        self._doubt_before = self._doubt.copy()
        self._left_share = 1.0
        self._rest = np.zeros(bins)

    def begin(self) -> None:
        """Begin anew with silence; the path is as it was, and may have changed a little."""
        self._known[:] = 0.0
        self._spectra[:] = 0.0
        self._doubt_before = self._doubt
        self._doubt = np.maximum(self._doubt, _NEW_DOUBT)
        self._left_share = 1.0

    def confirm(self) -> None:
        """Take the path for what it was before `begin`: it has been seen to hold."""
        known = np.maximum(self._doubt_before, _CONFIRMED_DOUBT)
        self._doubt = np.minimum(self._doubt, known)
        self._left_share = _CONFIRMED_SHARE

    def feed(self, known: Wave, heard: Wave) -> Wave:
        """Return what was heard without the echo of `known`; both are 256 samples of one moment."""
        self._shift_in(known)
        echo = np.fft.irfft((self._path * self._spectra).sum(axis=0))[BLOCK:]
        rest = heard - echo
        self._learn(np.fft.rfft(np.concatenate((np.zeros(BLOCK), rest))))
        return rest.astype(np.float32)

    def _shift_in(self, known: Wave) -> None:
        self._known[:BLOCK] = self._known[BLOCK:]
        self._known[BLOCK:] = known
        self._spectra[1:] = self._spectra[:-1]
        self._spectra[0] = np.fft.rfft(self._known)

    def _learn(self, rest: NDArray[np.complex128]) -> None:
        self._rest += (1.0 - _REST_SMOOTHING) * (np.abs(rest) ** 2 - self._rest)
        powers = np.abs(self._spectra) ** 2
        left = (powers * self._doubt).sum(axis=0)
        self.left_power = self._left_share * float(left.sum()) / BLOCK**2
        gain = self._doubt / (left + self._rest + _TINY)
        taps = np.fft.irfft(gain * self._spectra.conj() * rest, axis=1)
        taps[:, BLOCK:] = 0.0
        self._path += np.fft.rfft(taps, axis=1)
        self._path *= _FORGETTING
        self._doubt *= _FORGETTING**2 * (1.0 - 0.5 * gain * powers)
        self._doubt += (1.0 - _FORGETTING**2) * np.abs(self._path) ** 2
