"""Keep the controllers of one wire: who hears whom, who wins, who comes back from bus-off."""

from collections.abc import Callable, Hashable

import can

from sim_twin.can.bus.error_frames import PROTOCOL
from sim_twin.can.bus.frame_bits import arbitration_key
from sim_twin.can.bus.station import Station


class Stations:
    """Hold one controller per owner; `cut` parts the ports from the nodes."""

    def __init__(self) -> None:
        self.cut = False
        self._by_owner: dict[Hashable, Station] = {}
        self._all: tuple[Station, ...] = ()

    def add(
        self,
        owner: Hashable,
        receive: Callable[[can.Message], None],
        supplied: Callable[[], bool],
        *,
        is_node: bool,
    ) -> Station:
        """Connect a controller."""
        station = Station(receive, supplied, is_node=is_node)
        self._by_owner[owner] = station
        self._introduce()
        return station

    def _introduce(self) -> None:
        self._all = tuple(self._by_owner.values())
        for station in self._all:
            station.others = tuple(other for other in self._all if other is not station)

    def of(self, owner: Hashable) -> Station:
        """Return the controller of a node or of a port.

        Raises:
            KeyError: it is not connected to this wire.
        """
        return self._by_owner[owner]

    def remove(self, owner: Hashable) -> Station:
        """Disconnect a controller."""
        station = self._by_owner.pop(owner)
        self._introduce()
        return station

    def chosen(self, owner: Hashable | None) -> tuple[Station, ...]:
        """Return one owner's controller; None stands for those of all ports."""
        if owner is not None:
            return (self.of(owner),)
        return tuple(station for station in self._all if not station.is_node)

    def all(self) -> tuple[Station, ...]:
        """Return every controller."""
        return self._all

    def sound(self) -> bool:
        """Return whether no controller has met an error or has something to send."""
        return all(station.sound for station in self._all)

    def waiting(self) -> list[Station]:
        """Return who has something to send."""
        return [station for station in self._all if station.queue]

    def listeners(self, senders: list[Station]) -> list[Station]:
        """Return the powered controllers that see what `senders` put on the wire."""
        sides = {sender.is_node for sender in senders}
        return [
            station
            for station in self._all
            if station not in senders
            and not station.bus_off
            and (not self.cut or station.is_node in sides)
            and station.supplied()
        ]


def arbitrate(contenders: list[Station]) -> list[Station]:
    """Return who sends the lowest identifier, the most dominant data first; the others have lost.

    More than one wins where identifiers are the same.
    """
    if len(contenders) == 1:
        return contenders
    keys = [arbitration_key(station.queue[0]) for station in contenders]
    best = min(keys)
    winners = []
    for station, key in zip(contenders, keys, strict=True):
        if key == best:
            winners.append(station)
        else:
            station.arbitration_losses += 1
    return winners if len(winners) == 1 else sorted(winners, key=_content)


def clash(senders: list[Station]) -> bool:
    """Return whether frames of one identifier destroy each other; a harmless loser is taken out.

    The dominant bits win, but a loser that is error active destroys the winner's frame too.
    """
    best = _content(senders[0])
    losers = [station for station in senders if _content(station) != best]
    if any(station.error_active for station in losers):
        return True
    for station in losers:
        senders.remove(station)
        station.transmit_failed(PROTOCOL)
    return False


def _content(station: Station) -> tuple[int, bytes]:
    frame = station.queue[0]
    return frame.dlc, bytes(frame.data)
