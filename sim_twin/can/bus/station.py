"""Be one CAN controller on the wire: its queue, its error counters, what it tells its owner."""

from collections import deque
from collections.abc import Callable
from operator import methodcaller
from typing import Final

import can

from sim_twin.can.bus.error_counters import ErrorCounters, ErrorState
from sim_twin.can.bus.error_frames import bus_error_frame, restarted_frame, state_frame

# A controller's mailboxes and the interface's queue in front of them.
QUEUE_FRAMES: Final = 16
_SUPPLIED: Final = methodcaller("supplied")


class Station:
    """Send and receive for one owner, an emulated node or an outside port.

    `supplied` tells whether the controller has power: without it nothing is acknowledged.
    """

    __slots__ = (
        "arbitration_losses",
        "bus_off",
        "counters",
        "frames_refused",
        "is_node",
        "others",
        "queue",
        "ready_ns",
        "receive",
        "report_bus_errors",
        "restart_ns",
        "supplied",
        "told",
        "wrong_bitrate",
    )

    def __init__(
        self, receive: Callable[[can.Message], None], supplied: Callable[[], bool], *, is_node: bool
    ) -> None:
        self.receive = receive
        self.supplied = supplied
        self.is_node = is_node
        self.others: tuple[Station, ...] = ()
        self.queue: deque[can.Message] = deque()
        self.counters = ErrorCounters()
        self.told = ErrorState.ACTIVE
        self.bus_off = False
        self.ready_ns = 0
        self.restart_ns: int | None = None
        self.wrong_bitrate = False
        self.report_bus_errors = False
        self.arbitration_losses = 0
        self.frames_refused = 0

    @property
    def sound(self) -> bool:
        """Return whether there is neither an error to remember nor a frame to send."""
        counters = self.counters
        return not (counters.tec or counters.rec or self.wrong_bitrate or self.queue)

    @property
    def is_heard(self) -> bool:
        """Return whether anybody else has power, and so acknowledges."""
        return any(map(_SUPPLIED, self.others))

    @property
    def error_active(self) -> bool:
        """Return whether the controller still destroys a frame that it finds wrong."""
        return self.told < ErrorState.PASSIVE

    def enqueue(self, frame: can.Message) -> bool:
        """Take a frame to send; tell whether there was room for it."""
        if self.bus_off or len(self.queue) >= QUEUE_FRAMES:
            self.frames_refused += 1
            return False
        self.queue.append(frame)
        return True

    def tell(self, error_class: int = 0) -> None:
        """Notify the owner of a new state, and of the error itself where asked for."""
        state = self.counters.state
        if error_class and self.report_bus_errors:
            self.receive(bus_error_frame(error_class, self.counters))
        if state is self.told:
            return
        self.told = state
        if state is ErrorState.BUS_OFF:
            self.bus_off = True
            self.queue.clear()
        self.receive(state_frame(self.counters))

    def transmitted(self) -> None:
        """Note that a frame went well."""
        if self.counters.tec:
            self.counters.transmitted()
            self.tell()

    def received(self, frame: can.Message) -> None:
        """Hand a frame to the owner."""
        if self.counters.rec:
            self.counters.received()
            self.tell()
        self.receive(frame)

    def transmit_failed(self, error_class: int) -> None:
        """Note an error while transmitting."""
        self.counters.transmit_failed()
        self.tell(error_class)

    def not_acknowledged(self, error_class: int) -> None:
        """Note that nobody has acknowledged."""
        self.counters.not_acknowledged()
        self.tell(error_class)

    def receive_failed(self, error_class: int, *, first: bool) -> None:
        """Note an error while receiving."""
        self.counters.receive_failed(first)
        self.tell(error_class)

    def go_bus_off(self) -> None:
        """Leave the bus until `restart`."""
        self.restart_ns = None
        self.counters.go_bus_off()
        self.tell()

    def come_back(self) -> None:
        """End the recovery from bus-off."""
        self.restart_ns = None
        self.counters.reset()
        self.told = ErrorState.ACTIVE
        self.bus_off = False
        self.receive(restarted_frame(self.counters))
