"""Connect emulated CAN nodes and outside ports as one bus: arbitration, timing, errors, faults."""

from collections import deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import can

from drivers.clock import NS_PER_S
from sim_twin.can.error_counters import ErrorState
from sim_twin.can.error_frames import BUS_ERROR, NO_ACKNOWLEDGEMENT, PROTOCOL
from sim_twin.can.frame_bits import (
    ERROR_FRAME_BITS,
    HEADER_BITS,
    INTERMISSION_BITS,
    RECOVERY_BITS,
    SUSPEND_BITS,
    frame_bits,
)
from sim_twin.can.frame_tamper import FrameTamper
from sim_twin.can.station import Station
from sim_twin.can.stations import Stations, arbitrate, clash

Port = Callable[[can.Message], None]
DEFAULT_BITRATE: Final = 1_000_000
DEFAULT_RESTART_S: Final = 0.1
BABBLE_DATA: Final = bytes(8)
# An error passive controller whom nobody hears tries for ever; that it does so often shows nowhere.
UNHEARD_RETRY_NS: Final = 1_000_000
_BABBLER: Final = "babbler"


class CanNode(Hashable, Protocol):
    """Emulate one node: take frames, and send through what `connect` was given.

    An error frame tells of the node's own controller and of nothing else.
    """

    @property
    def supplied(self) -> bool:
        """Tell whether the node has power; without it nobody acknowledges for it."""
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


@dataclass(slots=True)
class _Attempt:
    """Be one attempt to send a frame; an error class of 0 goes well."""

    frame: can.Message
    senders: list[Station]
    error_class: int
    flagging: Station | None
    end_ns: int = 0
    free_ns: int = 0

    @property
    def fails_early(self) -> bool:
        """Tell whether the error is found in the frame's head and not by its CRC or ACK."""
        return bool(self.error_class) and (self.flagging is not None or len(self.senders) > 1)


class CanWire:
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
        self.bitrate = bitrate
        self.timed = timed
        self.frames_carried = 0
        self.frames_destroyed = 0
        self.frames_lost = 0
        self._restart_s = restart_s
        self._stations = Stations()
        self._tamper = FrameTamper()
        self._babbler: Station | None = None
        self._on_wire: _Attempt | None = None
        self._delayed: deque[tuple[int, _Attempt]] = deque()
        self._now_ns = 0
        self._free_ns = 0
        self._until_ns = 0
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
        """Hand every further frame to `port`; SocketCAN calls the option `berr-reporting`."""
        station = self._stations.add(port, port, lambda: True, is_node=False)
        station.report_bus_errors = report_bus_errors
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
        self._run(self._now_ns)
        return taken

    def _send_for(self, node: CanNode, frame: can.Message) -> None:
        self.send(frame, node)

    def poll(self, now_ns: int) -> None:
        """Carry what is due at `now_ns`; time never goes back."""
        self._recover(now_ns)
        self._run(now_ns)
        while self._delayed and self._delayed[0][0] <= now_ns:
            due_ns, attempt = self._delayed.popleft()
            self._now_ns = max(self._now_ns, due_ns)
            self._hand_over(attempt)
        self._now_ns = max(self._now_ns, now_ns)
        self._run(now_ns)

    def next_due_ns(self) -> int | None:
        """Return when `poll` has something to do, or None where only a new frame brings work."""
        stations = self._stations.all()
        due = [station.restart_ns for station in stations if station.restart_ns is not None]
        due += [due_ns for due_ns, _ in self._delayed]
        if self._on_wire is not None:
            due.append(self._on_wire.end_ns)
        else:
            due += [max(self._free_ns, station.ready_ns) for station in self._stations.waiting()]
        return min(due, default=None)

    @property
    def cut(self) -> bool:
        """Tell whether the plug between ports and nodes is pulled."""
        return self._stations.cut

    @cut.setter
    def cut(self, pulled: bool) -> None:
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
        for station in self._stations.chosen(owner):
            self._abandon(station)
            station.go_bus_off()

    def restart(self, owner: Hashable | None = None) -> None:
        """Let a controller recover: it is back after 128 times 11 recessive bits."""
        for station in self._stations.chosen(owner):
            if station.bus_off:
                station.restart_ns = self._now_ns + self._bits_ns(RECOVERY_BITS)

    def babble(self, can_id: int = 0, *, on: bool) -> None:
        """Flood the wire with one identifier; while it lasts, frames take the time of their bits.

        With an identifier below all others nobody else is heard.
        """
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
        self._stations.of(owner).wrong_bitrate = on

    def drop_every(self, count: int) -> None:
        """Lose every `count`-th frame in the receivers' overrun queues; 0 loses none.

        Raises:
            ValueError: the count is negative.
        """
        self._tamper.drop_every(count)

    def drop_ratio(self, ratio: float, seed: int = 0) -> None:
        """Lose this share of the frames in the receivers' overrun queues.

        Raises:
            ValueError: the ratio is not in 0..1.
        """
        self._tamper.drop_ratio(ratio, seed)

    def corrupt(self, ratio: float, seed: int = 0) -> None:
        """Destroy this share of the attempts by a CRC error; they are repeated, as CAN does.

        Raises:
            ValueError: the ratio is not in 0..1.
        """
        self._tamper.corrupt_ratio(ratio, seed)

    def delay(self, seconds: float) -> None:
        """Hand every frame on this much later, as a gateway would; needs `poll`.

        Raises:
            ValueError: the time is negative.
        """
        self._tamper.delay(seconds)

    def _run(self, until_ns: int) -> None:
        if self._running:
            return
        self._running = True
        self._until_ns = until_ns
        try:
            while self._finish(until_ns) and self._begin(until_ns):
                pass
        finally:
            self._running = False

    def _begin(self, until_ns: int) -> bool:
        waiting = self._stations.waiting()
        if not waiting:
            return False
        start_ns = max(self._free_ns, min([station.ready_ns for station in waiting]))
        if start_ns > until_ns:
            return False
        self._now_ns = max(self._now_ns, start_ns)
        senders = arbitrate([station for station in waiting if station.ready_ns <= start_ns])
        error_class, flagging = self._judge(senders)
        self._on_wire = attempt = _Attempt(senders[0].queue[0], senders, error_class, flagging)
        self._time(attempt, start_ns)
        return True

    def _judge(self, senders: list[Station]) -> tuple[int, Station | None]:
        """Return the class of the error that ends this attempt, and who flags it before all."""
        if len(senders) > 1 and self._clash(senders):
            return PROTOCOL, None
        sender, listeners = senders[0], self._stations.listeners(senders)
        if sender.wrong_bitrate or sender.queue[0].is_fd:
            return PROTOCOL, sender
        misled = [each for each in listeners if each.wrong_bitrate]
        for station in misled:
            if station.error_active:
                return PROTOCOL, station
        if self._tamper.damages():
            return PROTOCOL, None
        heard = len(listeners) > len(misled) or len(senders) > 1
        return (0 if heard else NO_ACKNOWLEDGEMENT), None

    def _clash(self, senders: list[Station]) -> bool:
        rivals = tuple(senders)
        destroyed = clash(senders)
        for station in rivals:
            self._plan_restart(station)
        return destroyed

    def _time(self, attempt: _Attempt, start_ns: int) -> None:
        attempt.end_ns = attempt.free_ns = start_ns
        if not self.timed and self._babbler is None:
            return
        bits = HEADER_BITS if attempt.fails_early else frame_bits(attempt.frame)
        bits += ERROR_FRAME_BITS if attempt.error_class else 0
        attempt.end_ns += self._bits_ns(bits)
        attempt.free_ns += self._bits_ns(bits + INTERMISSION_BITS)

    def _finish(self, until_ns: int) -> bool:
        """End the attempt that is on the wire; tell whether the wire is free."""
        attempt = self._on_wire
        if attempt is None:
            return True
        if attempt.end_ns > until_ns:
            return False
        self._on_wire = None
        self._now_ns = max(self._now_ns, attempt.end_ns)
        self._free_ns = attempt.free_ns
        if attempt.error_class:
            self._destroyed(attempt)
        else:
            self._carried(attempt)
        return True

    def _carried(self, attempt: _Attempt) -> None:
        self.frames_carried += 1
        for sender in attempt.senders:
            sender.queue.popleft()
            if sender is self._babbler:
                sender.queue.append(attempt.frame)
            sender.transmitted()
            self._suspend(sender)
        if self._tamper.loses():
            self.frames_lost += 1
        elif self._tamper.delay_ns:
            self._delayed.append((self._now_ns + self._tamper.delay_ns, attempt))
        else:
            self._hand_over(attempt)

    def _hand_over(self, attempt: _Attempt) -> None:
        for station in self._stations.listeners(attempt.senders):
            if not station.wrong_bitrate:
                station.received(attempt.frame)

    def _destroyed(self, attempt: _Attempt) -> None:
        self.frames_destroyed += 1
        if attempt.error_class == NO_ACKNOWLEDGEMENT:
            self._not_acknowledged(attempt.senders[0])
            return
        for station in self._stations.listeners(attempt.senders):
            station.receive_failed(BUS_ERROR, first=station is attempt.flagging)
        for sender in attempt.senders:
            sender.transmit_failed(attempt.error_class)
            self._suspend(sender)
            self._plan_restart(sender)

    def _not_acknowledged(self, sender: Station) -> None:
        sender.not_acknowledged(NO_ACKNOWLEDGEMENT)
        self._suspend(sender)
        if not self.timed or not sender.error_active:
            sender.ready_ns = self._until_ns + UNHEARD_RETRY_NS

    def _suspend(self, sender: Station) -> None:
        """Let an error passive sender wait before its next frame, as the standard asks."""
        pause_ns = self._bits_ns(SUSPEND_BITS) if self.timed and not sender.error_active else 0
        sender.ready_ns = self._free_ns + pause_ns

    def _plan_restart(self, station: Station) -> None:
        if station.bus_off and self._restart_s is not None:
            pause_ns = round(self._restart_s * NS_PER_S)
            station.restart_ns = self._now_ns + pause_ns + self._bits_ns(RECOVERY_BITS)

    def _recover(self, now_ns: int) -> None:
        for station in self._stations.all():
            if station.restart_ns is not None and station.restart_ns <= now_ns:
                self._now_ns = max(self._now_ns, station.restart_ns)
                station.come_back()

    def _abandon(self, station: Station) -> None:
        attempt = self._on_wire
        if attempt is not None and station in attempt.senders:
            self._on_wire = None
        station.queue.clear()

    def _bits_ns(self, bits: int) -> int:
        return bits * NS_PER_S // self.bitrate
