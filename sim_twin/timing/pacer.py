"""Pace the twin's time: at most as fast as the wall clock, or as fast as the computer can."""

from typing import Final

from drivers.clock import Clock

_FORGIVEN_NS: Final = 20_000_000
"""What time is behind by more than this, because somebody held it, is not caught up with."""


class Pacer:
    """Say how long to wait until time may reach a moment; `is_fast` never waits."""

    def __init__(self, clock: Clock, *, is_fast: bool) -> None:
        self._clock = clock
        self._is_fast = is_fast
        self._offset_ns = 0

    def start(self, now_ns: int) -> None:
        """Begin at `now_ns`."""
        self._offset_ns = now_ns - self._clock.now_ns()

    def wait_ns(self, next_ns: int) -> int:
        """Return how long from now until `next_ns` is due, at least 0."""
        if self._is_fast:
            return 0
        wait_ns = next_ns - self._offset_ns - self._clock.now_ns()
        if wait_ns < -_FORGIVEN_NS:
            self._offset_ns -= -_FORGIVEN_NS - wait_ns
        return max(0, wait_ns)


class RealTimeFactor:
    """Measure simulated over wall time in windows of about a second."""

    def __init__(self, wall_ns: int, now_ns: int, window_ns: int = 1_000_000_000) -> None:
        self.value = 1.0
        self._window_ns = window_ns
        self._wall_ns = wall_ns
        self._now_ns = now_ns

    def update(self, wall_ns: int, now_ns: int) -> bool:
        """Renew `value` when a window is complete; return whether one is."""
        elapsed_ns = wall_ns - self._wall_ns
        if elapsed_ns < self._window_ns:
            return False
        self.value = (now_ns - self._now_ns) / elapsed_ns
        self._wall_ns, self._now_ns = wall_ns, now_ns
        return True
