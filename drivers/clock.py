"""Give every component the same, injectable notion of monotonic time."""

import select
import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

NS_PER_S = 1_000_000_000

WaitReadable = Callable[[select.poll, int], bool]
"""Wait until a poll object has input, at most until a deadline; return whether it has."""


class Clock(Protocol):
    """Read and wait for monotonic time; the twin's clocks move simulated time instead."""

    def now_ns(self) -> int:
        """Return monotonic time in nanoseconds."""
        ...

    def sleep_until(self, deadline_ns: int) -> None:
        """Return at `deadline_ns` or at once when it has passed."""
        ...


@runtime_checkable
class DescriptorClock(Clock, Protocol):
    """Wait for input as well, in a time that is not the kernel's."""

    def wait_readable(self, poll: select.poll, deadline_ns: int) -> bool:
        """Return True as soon as `poll` has input, False at `deadline_ns`."""
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


def waiter_of(clock: Clock) -> WaitReadable:
    """Return how a descriptor is waited for on this clock: by the clock, or in the kernel."""
    if isinstance(clock, DescriptorClock):
        return clock.wait_readable

    def wait_readable(poll: select.poll, deadline_ns: int) -> bool:
        remaining_ns = deadline_ns - clock.now_ns()
        return bool(poll.poll(remaining_ns / 1e6 if remaining_ns > 0 else 0))

    return wait_readable
