"""Keep the controllers of one wire: who hears whom, who wins, who comes back from bus-off."""

from collections.abc import Callable, Hashable

import can

from sim_twin.can.error_frames import PROTOCOL
from sim_twin.can.frame_bits import arbitration_key
from sim_twin.can.station import Station


class Stations:
    """Hold one controller per owner; `cut` parts the ports from the nodes."""

    def __init__(self) -> None:
        self.cut = False
        self._by_owner: dict[Hashable, Station] = {}

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
        return station

    def of(self, owner: Hashable) -> Station:
        """Return the controller of a node or of a port.

        Raises:
            KeyError: it is not connected to this wire.
        """
        return self._by_owner[owner]

    def remove(self, owner: Hashable) -> Station:
        """Disconnect a controller."""
        return self._by_owner.pop(owner)

    def chosen(self, owner: Hashable | None) -> tuple[Station, ...]:
        """Return one owner's controller; None stands for those of all ports."""
        if owner is not None:
            return (self.of(owner),)
        return tuple(station for station in self._by_owner.values() if not station.is_node)

    def all(self) -> tuple[Station, ...]:
        """Return every controller."""
        return tuple(self._by_owner.values())

    def waiting(self) -> list[Station]:
        """Return who has something to send."""
        return [station for station in self._by_owner.values() if station.queue]

    def listeners(self, senders: list[Station]) -> list[Station]:
        """Return the powered controllers that see what `senders` put on the wire."""
        cut, sides = self.cut, {sender.is_node for sender in senders}
        return [
            station
            for station in self._by_owner.values()
            if station not in senders
            and not station.bus_off
            and (not cut or station.is_node in sides)
            and station.supplied()
        ]


def arbitrate(contenders: list[Station]) -> list[Station]:
    """Return who sends the lowest identifier, the most dominant data first; the others have lost.

    More than one wins where identifiers are the same.
    """
    if len(contenders) == 1:
        return contenders
    keys = {id(station): arbitration_key(station.queue[0]) for station in contenders}
    best = min(keys.values())
    winners = [station for station in contenders if keys[id(station)] == best]
    for station in contenders:
        station.arbitration_losses += keys[id(station)] != best
    return sorted(winners, key=_content)


def clash(senders: list[Station]) -> bool:
    """Tell whether frames of one identifier destroy each other; a harmless loser is taken out.

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
