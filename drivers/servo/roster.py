"""Decide which servos the block read asks, so that a dead one does not cost the others."""

from collections.abc import Sequence
from typing import Final

SUSPEND_AFTER: Final = 3


class Roster:
    """Keep the servos, by index, that are polled; a suspended one is pinged now and then."""

    def __init__(self, count: int) -> None:
        self.polled = tuple(range(count))
        self._count = count
        self._misses: dict[int, int] = {}

    @property
    def suspended(self) -> tuple[int, ...]:
        """Return the servos that are not polled."""
        return tuple(sorted(set(range(self._count)) - set(self.polled)))

    def note_complete(self) -> None:
        """Take note that all polled servos have answered."""
        if self._misses:
            self._misses.clear()

    def note_missing(self, blamed: Sequence[int]) -> tuple[int, ...]:
        """Count a cycle that some servos spoiled; return those that are suspended now."""
        self._misses = {index: self._misses.get(index, 0) + 1 for index in blamed}
        dropped = tuple(index for index in blamed if self._misses[index] >= SUSPEND_AFTER)
        if len(dropped) == len(self.polled):
            return ()
        self.polled = tuple(index for index in self.polled if index not in dropped)
        return dropped

    def suspend(self, index: int) -> None:
        """Take out a servo that is known to be away, as after a reboot; the last one stays."""
        self.polled = tuple(polled for polled in self.polled if polled != index) or self.polled

    def resume(self, index: int) -> None:
        """Poll a servo again."""
        self._misses.pop(index, None)
        self.polled = tuple(sorted({*self.polled, index}))
