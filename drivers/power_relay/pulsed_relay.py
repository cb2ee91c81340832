"""Feed a relay board by a pulse train on a GPIO line.

The board has a retriggerable monostable that holds the relay for a while after each rising edge. So
a computer that dies, hangs, or leaves the line at either level lets it fall.
"""

from contextlib import suppress

from drivers.errors import LinkLost
from drivers.power_relay.base import LevelOutput


class PulsedRelay:
    """Change the line's level with each feed; two feeds are one pulse."""

    def __init__(self, line: LevelOutput) -> None:
        self._line = line
        self._is_high = False

    def feed(self) -> None:
        """Send half of a pulse.

        Raises:
            LinkLost: the line has gone.
        """
        self._line.drive(not self._is_high)
        self._is_high = not self._is_high

    def cut(self) -> None:
        """Let the line lie low.

        Raises:
            LinkLost: the line has gone.
        """
        if self._is_high:
            self._line.drive(False)
            self._is_high = False

    def close(self) -> None:
        """Let the line lie low and release it; closing twice is allowed."""
        with suppress(LinkLost):
            self.cut()
        self._line.close()
