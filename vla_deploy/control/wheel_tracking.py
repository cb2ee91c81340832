"""Tell how fast the wheels turn by their encoders' counts, beside how fast they were told to."""

from collections import deque

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.control.axes import Floats

WINDOW_NS = NS_PER_S // 10


class WheelTracking:
    """Average both speeds over the last tenth of a second in which the drives have followed.

    A drive's own word for its speed does not count here: one that repeats itself would agree with
    a constant command for ever.
    """

    def __init__(self, wheel_count: int) -> None:
        self._nothing = np.zeros(wheel_count)
        self.forget()

    def forget(self) -> None:
        """Start over: the drives do not follow, or their counters began anew."""
        self.commanded_rad_s = self.measured_rad_s = self._nothing
        self._due_rad = self._nothing
        self._past: deque[tuple[int, Floats, Floats]] = deque()

    def note(self, now_ns: int, commanded_rad_s: Floats, position_rad: Floats) -> None:
        """Take in what one tick has commanded and where the wheels are."""
        past = self._past
        if past:
            self._due_rad = self._due_rad + commanded_rad_s * ((now_ns - past[-1][0]) / NS_PER_S)
        past.append((now_ns, self._due_rad, position_rad))
        if now_ns - past[0][0] < WINDOW_NS:
            return
        while now_ns - past[1][0] >= WINDOW_NS:
            past.popleft()
        then_ns, then_due_rad, then_rad = past[0]
        elapsed_s = (now_ns - then_ns) / NS_PER_S
        self.commanded_rad_s = (self._due_rad - then_due_rad) / elapsed_s
        self.measured_rad_s = (position_rad - then_rad) / elapsed_s
