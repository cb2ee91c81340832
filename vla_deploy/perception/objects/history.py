"""Remember the joints' last two seconds, to know where the camera was when an image was taken."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEEP_NS = 2_000_000_000


class JointHistory:
    """Interpolate joint positions between samples."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Array]] = deque()

    def add(self, stamp_ns: int, positions: Array) -> None:
        """Append a sample; one that is not newer than the last is ignored."""
        if self._samples and stamp_ns <= self._samples[-1][0]:
            return
        self._samples.append((stamp_ns, positions))
        while self._samples[0][0] < stamp_ns - KEEP_NS:
            self._samples.popleft()

    def at(self, stamp_ns: int, max_gap_ns: int) -> Array | None:
        """Return the positions at a moment, None where too little is known of them.

        Between two samples they are taken to move evenly, unless the samples lie further apart than
        the gap; before the first and after the last they are held for as long.
        """
        if not self._samples:
            return None
        stamps = np.array([stamp for stamp, _ in self._samples], dtype=np.int64)
        after = int(np.searchsorted(stamps, stamp_ns))
        if after == 0 or after == len(stamps):
            nearest = min(after, len(stamps) - 1)
            near = abs(int(stamps[nearest]) - stamp_ns) <= max_gap_ns
            return self._samples[nearest][1] if near else None
        (first_ns, first), (second_ns, second) = self._samples[after - 1], self._samples[after]
        if stamp_ns == second_ns:
            return second
        if second_ns - first_ns > max_gap_ns:
            return None
        share = (stamp_ns - first_ns) / (second_ns - first_ns)
        blended: Array = first + share * (second - first)
        return blended
