"""Let the twin's time be the wall clock: nobody is waited for, delays are caught up with."""

from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock

_MOST_WAIT_S: Final = 0.02


class TimeKeeper(Protocol):
    """Say what time it is, and when it may go on."""

    blamed_ns: dict[str, int]
    excused: list[str]

    @property
    def now_ns(self) -> int:
        """Return the time on the clock of the run."""
        ...

    def filenos(self) -> list[int]:
        """Return the descriptors whose input calls for `serve`."""
        ...

    def serve(self, ready: set[int]) -> None:
        """Take what members say."""
        ...

    def note_writes(self) -> None:
        """Let those look again who wait for a device."""
        ...

    def go_round(self) -> int:
        """Look after the members; return how far time has leapt meanwhile."""
        ...

    def wake_next(self) -> bool:
        """Wake who is due; False when nobody is."""
        ...

    def next_wake_ns(self) -> int | None:
        """Return when the next member is due, None when nobody waits."""
        ...

    def wait_s(self, next_ns: int) -> float:
        """Return how long to wait before time may go to `next_ns`."""
        ...

    def blame(self, next_ns: int, waited_ns: int) -> None:
        """Note who held time for a while."""
        ...

    def advance(self, to_ns: int) -> None:
        """Move time."""
        ...

    def close(self) -> None:
        """Give time back."""
        ...


class WallTime:
    """Keep time by a clock that waits for nobody, CLOCK_MONOTONIC."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.blamed_ns: dict[str, int] = {}
        self.excused: list[str] = []

    @property
    def now_ns(self) -> int:
        """Return the clock's time."""
        return self._clock.now_ns()

    def filenos(self) -> list[int]:
        """Return none: nobody takes part."""
        return []

    def serve(self, ready: set[int]) -> None:
        """Do nothing."""

    def note_writes(self) -> None:
        """Do nothing: the kernel wakes who waits."""

    def go_round(self) -> int:
        """Return 0: this clock never leaps."""
        return 0

    def wake_next(self) -> bool:
        """Return False: the kernel wakes who waits."""
        return False

    def next_wake_ns(self) -> int | None:
        """Return None: nobody takes part."""
        return None

    def wait_s(self, next_ns: int) -> float:
        """Return how long it is until `next_ns`."""
        return min(max(0, next_ns - self._clock.now_ns()) / NS_PER_S, _MOST_WAIT_S)

    def blame(self, next_ns: int, waited_ns: int) -> None:
        """Do nothing: time waits for nobody."""

    def advance(self, to_ns: int) -> None:
        """Do nothing: time moves by itself."""

    def close(self) -> None:
        """Do nothing."""
