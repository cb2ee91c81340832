"""Say what sound is inside the speech process: one channel at 16 kHz, in stamped blocks."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S

RATE_HZ: Final = 16_000
SILENCE_DB: Final = -100.0
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
    if not len(samples):
        return SILENCE_DB
    power = float(np.var(samples, dtype=np.float64))
    return max(SILENCE_DB, 10.0 * float(np.log10(power + 1e-12)))
