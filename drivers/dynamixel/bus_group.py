"""Read several servo buses in the time of the slowest, without a thread.

All requests are sent before the first answer is awaited; the kernel keeps what arrives meanwhile.
"""

from collections.abc import Iterator, Sequence

from drivers.dynamixel.bus import DynamixelBus
from drivers.errors import LinkLost


class BusGroup:
    """Read connected buses side by side; a lost one costs the others nothing."""

    def __init__(self, buses: Sequence[DynamixelBus]) -> None:
        """Take the buses, which stay the caller's.

        Raises:
            ValueError: there is no bus.
        """
        if not buses:
            raise ValueError("a bus group needs at least one bus, got none")
        self.buses = tuple(buses)

    def read_states(self) -> list[LinkLost | None]:
        """Refresh every bus' `state`; return per bus what it has lost, or None.

        Raises:
            DriverError: a bus is not connected.
        """
        losses: list[LinkLost | None] = [None] * len(self.buses)
        under_way = dict(enumerate(bus.read_in_turns() for bus in self.buses))
        while under_way:
            for index, turns in list(under_way.items()):
                try:
                    more = _advance(turns)
                except LinkLost as error:
                    losses[index], more = error, False
                if not more:
                    del under_way[index]
        return losses


def _advance(turns: Iterator[None]) -> bool:
    for _ in turns:
        return True
    return False
