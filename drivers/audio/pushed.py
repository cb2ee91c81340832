"""Be a microphone whose samples somebody else brings, such as a browser's over the web page."""

from collections import deque
from typing import Final

import numpy as np

from drivers.audio.base import AudioBlock, AudioCounters, AudioFormat, Samples, check_samples
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost

BACKLOG_NS: Final = NS_PER_S
SILENT_NS: Final = 3 * NS_PER_S


class PushedInput:
    """Hold what was pushed until it is polled, the last second of it; use both in one thread.

    Pushed samples end at the moment of the push: a browser's clock means nothing here.
    """

    def __init__(self, format_: AudioFormat, clock: Clock) -> None:
        self.format = format_
        self.counters = AudioCounters()
        self._clock = clock
        self._waiting: deque[Samples] = deque()
        self._rows = 0
        self._end_ns = clock.now_ns()
        self._last_stamp_ns = 0
        self._closed = False

    def push(self, samples: Samples) -> None:
        """Take the next samples; of what nobody polled the oldest are lost and counted.

        Raises:
            ValueError: the samples do not have the format's channels.
            LinkLost: the microphone is closed.
        """
        if self._closed:
            raise LinkLost("pushed microphone: it is closed; open another one")
        check_samples(samples, self.format)
        self._waiting.append(samples)
        self._rows += len(samples)
        self._end_ns = self._clock.now_ns()
        most = BACKLOG_NS * self.format.rate_hz // NS_PER_S
        while len(self._waiting) > 1 and self._rows > most:
            lost = len(self._waiting.popleft())
            self._rows -= lost
            self.counters.lost_samples += lost

    def poll(self) -> AudioBlock | None:
        """Return the samples since the last call as one block, or None; never waits.

        Raises:
            LinkLost: it is closed, or nobody has pushed anything for 3 s.
        """
        if self._closed or self._clock.now_ns() - self._end_ns > SILENT_NS:
            raise LinkLost("pushed microphone: nobody sends sound any more; connect again")
        if not self._rows:
            return None
        samples = np.concatenate(self._waiting)
        self._waiting.clear()
        self._rows = 0
        self.counters.blocks += 1
        self.counters.samples += len(samples)
        return AudioBlock(stamp_ns=self._stamp(len(samples)), format=self.format, samples=samples)

    def close(self) -> None:
        """Refuse what is pushed from now on; closing twice is allowed."""
        self._closed = True
        self._waiting.clear()
        self._rows = 0

    def _stamp(self, count: int) -> int:
        stamp_ns = self._end_ns - self.format.duration_ns(count)
        self._last_stamp_ns = max(stamp_ns, self._last_stamp_ns + 1)
        return self._last_stamp_ns
