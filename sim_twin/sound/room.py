"""Be the room that the robot's speaker, its microphone and people share.

Everything that sounds is laid onto the rows of the microphone as it will arrive there. Sound is
mixed only when the microphone is read: a room that nobody listens to costs nothing.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.audio.base import FULL_SCALE, Samples
from drivers.audio.clip import Wave
from drivers.clock import NS_PER_S
from sim_twin.sound.acoustics import Acoustics, path, through

NOISE_SIGMA: Final = 12.0
"""Of the quiet room and the microphone, in steps of 16 bits."""
MAX_PENDING_S: Final = 120.0


@dataclass(frozen=True, slots=True, eq=False)
class _Sounding:
    """Hold one sound as it arrives at the microphone, row `starts` first."""

    starts: int
    wave: NDArray[np.float32]

    @property
    def ends(self) -> int:
        return self.starts + len(self.wave)


class Room:
    """Mix what arrives at the microphone, on the rows of its own rate."""

    def __init__(self, rate_hz: int, seed: int = 0, acoustics: Acoustics | None = None) -> None:
        self.rate_hz = rate_hz
        self.acoustics = acoustics or Acoustics()
        self._random = np.random.default_rng(seed)
        self._sounding: list[_Sounding] = []
        own = self.acoustics
        self._speaker_path = own.speaker_gain * path(own.speaker_distance_m, rate_hz, own, seed)

    def row_at(self, time_ns: int) -> int:
        """Return the row of a simulated time."""
        return time_ns * self.rate_hz // NS_PER_S

    def lay(self, wave: Wave, starts: int) -> None:
        """Let a sound arrive at the microphone from row `starts` on; 1 is full scale.

        What comes later than anybody can listen is dropped: a test that never reads must not fill
        the memory.
        """
        self._sounding.append(_Sounding(starts, wave * np.float32(FULL_SCALE)))
        oldest = starts - round(MAX_PENDING_S * self.rate_hz)
        self._sounding = [each for each in self._sounding if each.ends > oldest]

    def sound_from_speaker(self, wave: Wave, starts_ns: int) -> None:
        """Let the robot's speaker sound from a moment on; `wave` is at the room's rate."""
        self.lay(through(wave, self._speaker_path), self.row_at(starts_ns))

    def heard(self, first: int, end: int, channels: int) -> Samples:
        """Return what arrives in rows `first` to `end`, over the noise; each row is read once."""
        sound = NOISE_SIGMA * self._random.standard_normal((end - first, channels))
        for each in self._sounding:
            low, high = max(first, each.starts), min(end, each.ends)
            if low < high:
                sound[low - first : high - first] += each.wave[
                    low - each.starts : high - each.starts, None
                ]
        self._sounding = [each for each in self._sounding if each.ends > end]
        return np.rint(sound).clip(-FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
