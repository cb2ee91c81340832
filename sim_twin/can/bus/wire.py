"""Connect emulated CAN nodes and outside ports as one bus: arbitration, timing, errors, faults."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import can

from sim_twin.can.bus.carrier import FrameCarrier
from sim_twin.can.bus.error_counters import ErrorState
from sim_twin.can.bus.frame_bits import RECOVERY_BITS

Port = Callable[[can.Message], None]
DEFAULT_BITRATE: Final = 1_000_000
DEFAULT_RESTART_S: Final = 0.1
BABBLE_DATA: Final = bytes(8)
_BABBLER: Final = "babbler"


class CanNode(Hashable, Protocol):
    """Emulate one node: take frames, and send through what `connect` was given.

    An error frame tells of the node's own controller and of nothing else.
    """

    @property
    def supplied(self) -> bool:
        """Return whether the node has power; without it nobody acknowledges for it."""
        ...

    def connect(self, send: Port) -> None:
        """Remember how to put a frame on the wire."""
        ...

    def receive(self, frame: can.Message) -> None:
        """Take one frame that someone else has sent."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class BusHealth:
    """Hold what one controller has counted: errors, lost arbitrations, frames without room."""

    tec: int
    rec: int
    state: ErrorState
    arbitration_losses: int
    frames_refused: int


class CanWire(FrameCarrier):
    """Carry each frame to all but its sender, the lowest identifier first.

    As delivered a frame takes no time. `timed` gives it the time of its bits, and `poll` has to be
    called with the simulated time: whenever `next_due_ns()` has passed, and before frames are put
    in from outside. Every node and every port is a controller of its own, with error counters as
    the standard has them. `cut` models a pulled plug between the ports (the robot's computer) and
    the nodes.
    """

    def __init__(
        self,
        nodes: Sequence[CanNode] = (),
        *,
        bitrate: int = DEFAULT_BITRATE,
        timed: bool = False,
        restart_s: float | None = DEFAULT_RESTART_S,
    ) -> None:
        """Build the wire; a controller that goes bus-off by itself restarts after `restart_s`."""
        super().__init__(bitrate=bitrate, timed=timed, restart_s=restart_s)
        self._ports_held = False
        self._running = True  # all nodes are there before the first of them speaks
        for node in nodes:
            self.add_node(node)
        self._running = False
        self._run(0)

    def add_node(self, node: CanNode) -> None:
        """Connect an emulated node."""
        self._stations.add(node, node.receive, lambda: node.supplied, is_node=True)
        node.connect(lambda frame: self._send_for(node, frame))

    def attach(self, port: Port, *, report_bus_errors: bool = False) -> None:
        """Hand every further frame to `port`; SocketCAN calls the option `berr-reporting`.

        While all ports are held off the bus, so is a new one: it is the same interface.
        """
        station = self._stations.add(port, port, lambda: True, is_node=False)
        station.report_bus_errors = report_bus_errors
        if self._ports_held:
            station.go_bus_off()
        for unheard in self._stations.waiting():
            unheard.ready_ns = min(unheard.ready_ns, self._now_ns)
        self._run(self._now_ns)

    def detach(self, port: Port) -> None:
        """Stop handing frames to `port`; what it still had to send is lost."""
        self._abandon(self._stations.remove(port))

    def send(self, frame: can.Message, sender: Hashable) -> bool:
        """Queue a frame at its sender's controller; tell whether there was room for it."""
        station = self._stations.of(sender)
        if not station.queue:
            station.ready_ns = max(station.ready_ns, self._now_ns)
        taken = station.enqueue(frame)
        if not self._running:
            self._run(self._now_ns)
        return taken

    def _send_for(self, node: CanNode, frame: can.Message) -> None:
        self.send(frame, node)

    @property
    def cut(self) -> bool:
        """Return whether the plug between ports and nodes is pulled."""
        return self._stations.cut

    @cut.setter
    def cut(self, pulled: bool) -> None:
        self._sound = False
        self._stations.cut = pulled

    def health(self, owner: Hashable) -> BusHealth:
        """Return what the controller of a node or port has counted.

        Raises:
            KeyError: it is not connected to this wire.
        """
        station = self._stations.of(owner)
        return BusHealth(
            tec=station.counters.tec,
            rec=station.counters.rec,
            state=station.told,
            arbitration_losses=station.arbitration_losses,
            frames_refused=station.frames_refused,
        )

    def set_bus_off(self, owner: Hashable | None = None) -> None:
        """Take a node or port, or None: every port, off the bus until `restart`."""
        self._sound = False
        self._ports_held = self._ports_held or owner is None
        for station in self._stations.chosen(owner):
            self._abandon(station)
            station.go_bus_off()

    def restart(self, owner: Hashable | None = None) -> None:
        """Let a controller recover: it is back after 128 times 11 recessive bits."""
        self._ports_held = self._ports_held and owner is not None
        for station in self._stations.chosen(owner):
            if station.bus_off:
                station.restart_ns = self._now_ns + self._bits_ns(RECOVERY_BITS)

    def babble(self, can_id: int = 0, *, on: bool) -> None:
        """Flood the wire with one identifier; while it lasts, frames take the time of their bits.

        With an identifier below all others nobody else is heard.
        """
        self._sound = False
        if self._babbler is not None:
            self._abandon(self._stations.remove(_BABBLER))
            self._babbler = None
        if on:
            self._babbler = self._stations.add(
                _BABBLER, lambda frame: None, lambda: True, is_node=True
            )
            self._babbler.ready_ns = self._now_ns
            self._babbler.enqueue(
                can.Message(arbitration_id=can_id, is_extended_id=False, data=BABBLE_DATA)
            )

    def set_wrong_bitrate(self, owner: Hashable, on: bool = True) -> None:
        """Let a node or port run at another bit rate than the rest of the bus."""
        self._sound = False
        self._stations.of(owner).wrong_bitrate = on

    def drop_every(self, count: int) -> None:
        """Lose every `count`-th frame in the receivers' overrun queues; 0 loses none.

        Raises:
            ValueError: the count is negative.
        """
        self._sound = False
        self._tamper.drop_every(count)

    def drop_ratio(self, ratio: float, seed: int = 0) -> None:
        """Lose this share of the frames in the receivers' overrun queues.

        Raises:
            ValueError: the ratio is not in 0..1.
        """
        self._sound = False
        self._tamper.drop_ratio(ratio, seed)

    def corrupt(self, ratio: float, seed: int = 0) -> None:
        """Destroy this share of the attempts by a CRC error; they are repeated, as CAN does.

        Raises:
            ValueError: the ratio is not in 0..1.
        """
        self._sound = False
        self._tamper.corrupt_ratio(ratio, seed)

    def delay(self, seconds: float) -> None:
        """Hand every frame on this much later, as a gateway would; needs `poll`.

        Raises:
            ValueError: the time is negative.
        """
        self._sound = False
        self._tamper.delay(seconds)
