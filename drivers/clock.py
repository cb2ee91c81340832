"""Give every component the same, injectable notion of monotonic time."""

import time
from typing import Protocol

NS_PER_S = 1_000_000_000


class Clock(Protocol):
    """Tell and wait for monotonic time; the twin's lock-step clock moves the simulation instead."""

    def now_ns(self) -> int:
        """Return monotonic time in nanoseconds."""
        ...

    def sleep_until(self, deadline_ns: int) -> None:
        """Return at `deadline_ns` or at once when it has passed."""
        ...


class MonotonicClock:
    """Read CLOCK_MONOTONIC, the one clock that never jumps."""

    now_ns = staticmethod(time.monotonic_ns)
    """Return CLOCK_MONOTONIC in nanoseconds; without a call in between, as it is asked often."""

    def sleep_until(self, deadline_ns: int) -> None:
        """Sleep to an absolute time, so that periods do not drift."""
        remaining_ns = deadline_ns - time.monotonic_ns()
        if remaining_ns > 0:
            time.sleep(remaining_ns / NS_PER_S)
