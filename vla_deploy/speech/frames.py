"""Cut a stream of blocks into frames of one length, each with its time."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from vla_deploy.speech.sound import NOTHING, Sound, SoundBlock, duration_ns
from vla_deploy.speech.voice_activity import FRAME


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """Hold 512 samples, 32 ms; the first frame after something was lost does not follow."""

    stamp_ns: int
    samples: Sound
    follows: bool

    @property
    def end_ns(self) -> int:
        """Return the time at which the frame ends."""
        return self.stamp_ns + duration_ns(FRAME)


def joined(frames: Iterable[Frame]) -> Sound:
    """Return the samples of frames in a row."""
    return np.concatenate([NOTHING, *(frame.samples for frame in frames)])


class Framing:
    """Hold what does not fill a frame yet."""

    def __init__(self) -> None:
        self._rest = NOTHING
        self._follows = False

    def feed(self, block: SoundBlock) -> Iterator[Frame]:
        """Yield the frames that are whole now; what was begun before a gap is dropped."""
        if not block.follows:
            self._rest = self._rest[:0]
            self._follows = False
        stamp_ns = block.stamp_ns - duration_ns(len(self._rest))
        sound = np.concatenate((self._rest, block.samples))
        whole = len(sound) // FRAME * FRAME
        self._rest = sound[whole:]
        for at in range(0, whole, FRAME):
            yield Frame(
                stamp_ns=stamp_ns + duration_ns(at),
                samples=sound[at : at + FRAME],
                follows=self._follows,
            )
            self._follows = True
