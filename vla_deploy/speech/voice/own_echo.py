"""Take the robot's own voice out of what its microphone hears, frame by frame.

What is handed to the speaker is noted with the time at which it will sound; the filter learns what
arrives of it, takes it out, and says how much may be left. What is no louder than that is the rest
of the echo, and is turned down; what is louder is somebody else.

It is a partitioned-block adaptive filter in the frequency domain with a Kalman gain (Enzner and
Vary, "Frequency-domain adaptive Kalman filter for acoustic echo control", Signal Processing 86,
2006; its partitioned form: Kuech, Mabande, Enzner, ICASSP 2014). The gain follows from how unsure
each tap is and how loud everything else is, so a person who speaks into the echo does not lead it
astray. The same doubt says how much of the echo may be left.
"""

from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.audio.clip import Wave
from drivers.clock import NS_PER_S
from vla_deploy.speech.sound import FRAME, RATE_HZ, SoundBlock, duration_ns

BLOCK: Final = 256
"""A frame is two of them."""
PARTITIONS: Final = 16
_FORGETTING: Final = 0.999
_FIRST_DOUBT: Final = 1.0
_NEW_DOUBT: Final = 0.3
_CONFIRMED_DOUBT: Final = 0.03
_CONFIRMED_SHARE: Final = 0.4  # what is left is less than the bound by as much, 99 times of 100
_FITS_RATIO: Final = 8.0  # of powers, 9 dB
_FITS_AFTER_BLOCKS: Final = 8
_AUDIBLE_POWER: Final = 1e-6
_REST_SMOOTHING: Final = 0.8
_TINY: Final = 1e-9
HEAD_START_NS: Final = NS_PER_S // 200
"""The reference comes this much early, in case stamps of speaker and microphone disagree."""
RINGS_NS: Final = duration_ns(BLOCK * PARTITIONS)
LEAST_GAIN: Final = 0.1
_GAIN_FALLS: Final = 0.6  # with each block: a word's end is not cut
_SILENT_POWER: Final = 1e-10
_SAME_NS: Final = NS_PER_S // 10_000


class EchoFilter:
    """Learn one path of up to 4096 samples; feed blocks of 256 that follow each other."""

    def __init__(self) -> None:
        self.left_power = 0.0
        """What of the echo may be left in the newest block at most: mean square of a sample."""
        bins = BLOCK + 1
        self._known = np.zeros(2 * BLOCK)
        self._spectra = np.zeros((PARTITIONS, bins), np.complex128)
        self._path = np.zeros((PARTITIONS, bins), np.complex128)
        self._doubt = self._doubt_before = np.full((PARTITIONS, bins), _FIRST_DOUBT)
        self._tried = np.zeros(3)
        self._is_confirmed = False
        self._rest = np.zeros(bins)

    def begin(self) -> None:
        """Begin anew with silence; the path is as it was, and may have changed a little."""
        self._known[:] = 0.0
        self._spectra[:] = 0.0
        self._tried[:], self._is_confirmed = 0.0, False
        self._doubt_before = self._doubt
        self._doubt = np.maximum(self._doubt, _NEW_DOUBT)

    def feed(self, known: Wave, heard: Wave) -> Wave:
        """Return what was heard without the echo of `known`; both are 256 samples of one moment."""
        self._shift_in(known)
        echo = np.fft.irfft((self._path * self._spectra).sum(axis=0))[BLOCK:]
        rest: Wave = (heard - echo).astype(np.float32)
        self._learn(np.fft.rfft(np.concatenate((np.zeros(BLOCK), rest))))
        if np.mean(known**2) > _AUDIBLE_POWER:
            self._confirm(heard, rest)
        return rest

    def _confirm(self, heard: Wave, rest: Wave) -> None:
        """Take the path for what it was before `begin`, once it has been seen to hold."""
        self._tried += 1.0, np.dot(heard, heard), np.dot(rest, rest)
        blocks, heard_power, rest_power = self._tried
        fits = blocks >= _FITS_AFTER_BLOCKS and heard_power > _FITS_RATIO * rest_power
        if fits and not self._is_confirmed:
            self._is_confirmed = True
            before = np.maximum(self._doubt_before, _CONFIRMED_DOUBT)
            self._doubt = np.minimum(self._doubt, before)

    def _shift_in(self, known: Wave) -> None:
        self._known[:BLOCK] = self._known[BLOCK:]
        self._known[BLOCK:] = known
        self._spectra[1:] = self._spectra[:-1]
        self._spectra[0] = np.fft.rfft(self._known)

    def _learn(self, rest: NDArray[np.complex128]) -> None:
        self._rest += (1.0 - _REST_SMOOTHING) * (np.abs(rest) ** 2 - self._rest)
        powers = np.abs(self._spectra) ** 2
        left = (powers * self._doubt).sum(axis=0)
        share = _CONFIRMED_SHARE if self._is_confirmed else 1.0
        self.left_power = share * float(left.sum()) / BLOCK**2
        gain = self._doubt / (left + self._rest + _TINY)
        taps = np.fft.irfft(gain * self._spectra.conj() * rest, axis=1)
        taps[:, BLOCK:] = 0.0
        self._path += np.fft.rfft(taps, axis=1)
        self._path *= _FORGETTING
        self._doubt *= _FORGETTING**2 * (1.0 - 0.5 * gain * powers)
        self._doubt += (1.0 - _FORGETTING**2) * np.abs(self._path) ** 2


@dataclass(slots=True, kw_only=True)
class _Played:
    """Hold a sound at 16 kHz whose first sample sounds, or would have, at `zero_ns`."""

    wave: Wave
    zero_ns: int
    from_ns: int
    until_ns: int


class OwnEcho:
    """Follow speaker and microphone."""

    def __init__(self) -> None:
        self.left_db = _db(0.0)
        """How loud what is left of the echo may be in the newest frame, RMS against full scale."""
        self._filter = EchoFilter()
        self._played: deque[_Played] = deque()
        self._is_active = False
        self._gain = 1.0

    def note(self, wave: Wave, zero_ns: int, until_ns: int) -> None:
        """Take what was handed to the speaker: `wave` at 16 kHz, from `zero_ns` to `until_ns`."""
        last = self._played[-1] if self._played else None
        if last is not None and last.wave is wave and abs(last.zero_ns - zero_ns) < _SAME_NS:
            last.until_ns = until_ns
            return
        from_ns = zero_ns if last is None else max(zero_ns, last.until_ns)
        self._played.append(_Played(wave=wave, zero_ns=zero_ns, from_ns=from_ns, until_ns=until_ns))

    def clean(self, frame: SoundBlock) -> SoundBlock:
        """Return a frame without the echo in it; while the robot is silent, as it is."""
        self._forget_before(frame.stamp_ns - RINGS_NS)
        if not self._played:
            self._is_active, self.left_db = False, _db(0.0)
            return frame
        if not self._is_active or not frame.follows:
            self._filter.begin()
            self._is_active, self._gain = True, 1.0
        parts, left_power = [], 0.0
        for at in range(0, FRAME, BLOCK):
            known = self._known(frame.stamp_ns + duration_ns(at) + HEAD_START_NS)
            rest = self._filter.feed(known, frame.samples[at : at + BLOCK])
            parts.append(self._turned_down(rest))
            left_power = max(left_power, self._filter.left_power)
        self.left_db = _db(left_power)
        return replace(frame, samples=np.concatenate(parts))

    def _turned_down(self, rest: Wave) -> Wave:
        """Return a block at the share of it that is no echo; the gain changes within it."""
        left, power = self._filter.left_power, float(np.mean(rest**2))
        other_ratio = max(0.0, 1.0 - left / power) if power > _SILENT_POWER else 0.0
        wanted = max(LEAST_GAIN, other_ratio**0.5, _GAIN_FALLS * self._gain)
        gains = np.linspace(self._gain, wanted, len(rest), dtype=np.float32)
        self._gain = wanted
        turned: Wave = rest * gains
        return turned

    def _known(self, stamp_ns: int) -> Wave:
        """Return what the speaker was given for the 256 samples from `stamp_ns` on."""
        known = np.zeros(BLOCK, np.float32)
        for played in self._played:
            first, end = (
                round((at_ns - stamp_ns) * RATE_HZ / NS_PER_S)
                for at_ns in (played.from_ns, played.until_ns)
            )
            zero = round((played.zero_ns - stamp_ns) * RATE_HZ / NS_PER_S)
            low, high = max(0, first, zero), min(BLOCK, end, zero + len(played.wave))
            if low < high:
                known[low:high] = played.wave[low - zero : high - zero]
        return known

    def _forget_before(self, oldest_ns: int) -> None:
        while self._played and self._played[0].until_ns < oldest_ns:
            self._played.popleft()


def _db(power: float) -> float:
    return float(10.0 * np.log10(max(power, _SILENT_POWER)))
