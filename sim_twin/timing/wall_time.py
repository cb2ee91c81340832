"""Keep the twin's time by the wall clock: no process is waited for, delays are made up."""

from typing import Final

from drivers.clock import NS_PER_S, Clock

_MOST_WAIT_S: Final = 0.02


class WallTime:
    """Keep time by a clock that waits for nobody; `Governor` has the same methods."""

    is_held = False
    """No member is waited for: devices answer at any time."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.blamed_ns: dict[str, int] = {}

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

    def go_on(self, event_ns: int) -> float | None:
        """Return how long it is until `event_ns`, None when it is due."""
        wait_ns = event_ns - self._clock.now_ns()
        return min(wait_ns / NS_PER_S, _MOST_WAIT_S) if wait_ns > 0 else None

    def close(self) -> None:
        """Do nothing."""
