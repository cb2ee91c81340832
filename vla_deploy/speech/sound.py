"""Say what sound is inside the speech process: one channel at 16 kHz, in stamped frames.

A device gives blocks of any length; all that listens takes frames of 512 samples, 32 ms.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S

RATE_HZ: Final = 16_000
_SILENT_POWER: Final = 1e-10
FRAME: Final = 512
FRAME_S: Final = FRAME / RATE_HZ
Sound = NDArray[np.float32]
NOTHING: Final[Sound] = np.zeros(0, np.float32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SoundBlock:
    """Hold samples from -1 to 1 of one channel at 16 kHz; `stamp_ns` is the time of the first one.

    `follows` is false where the block does not continue the one before: something was lost between
    them, or it is the first one.
    """

    stamp_ns: int
    samples: Sound
    follows: bool = True

    @property
    def end_ns(self) -> int:
        """Return the time at which the block ends."""
        return self.stamp_ns + duration_ns(len(self.samples))


@dataclass(frozen=True, slots=True, kw_only=True)
class Playing:
    """Describe what sounds from the speaker at a moment.

    The robot knows its own words by `text` when it hears them; `echo_db` is how loud the microphone
    may hear them at this moment after their echo was taken out, RMS against full scale.
    """

    say_id: str
    text: str
    echo_db: float


class Framer:
    """Cut a stream of blocks into blocks of `FRAME` samples."""

    def __init__(self) -> None:
        self._rest = NOTHING
        self._follows = False

    def feed(self, block: SoundBlock) -> Iterator[SoundBlock]:
        """Yield the frames that are whole now; what was begun before a gap is dropped."""
        if not block.follows:
            self._rest = NOTHING
            self._follows = False
        stamp_ns = block.stamp_ns - duration_ns(len(self._rest))
        sound = np.concatenate((self._rest, block.samples))
        whole = len(sound) // FRAME * FRAME
        self._rest = sound[whole:]
        for at in range(0, whole, FRAME):
            samples = sound[at : at + FRAME]
            yield SoundBlock(
                stamp_ns=stamp_ns + duration_ns(at), samples=samples, follows=self._follows
            )
            self._follows = True


def duration_ns(count: int) -> int:
    """Return how long `count` samples last."""
    return count * NS_PER_S // RATE_HZ


def count_of(duration_s: float) -> int:
    """Return how many samples last that long."""
    return round(duration_s * RATE_HZ)


def level_db(samples: Sound) -> float:
    """Return how loud samples are: RMS against full scale, -100 dB at the least.

    A constant offset, as cheap microphones have one, is no sound.
    """
    return 10.0 * float(np.log10(np.var(samples, dtype=np.float64) + _SILENT_POWER))
