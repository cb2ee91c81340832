"""Send and receive frames of one CAN bus without ever waiting, and watch over the bus itself."""

import errno
from typing import Final

import can

from drivers.can.errors import BusOff, ControllerState, ControllerWatch
from drivers.clock import NS_PER_S, Clock
from drivers.errors import LinkLost, ProtocolError

FRAMES_PER_DRAIN: Final = 256  # so that a babbling node cannot hold up the tick
STUCK_NS: Final = 100_000_000
# What a CAN interface says when it is down or unplugged; anything else is a full transmit queue.
_GONE: Final = frozenset(
    {errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.ENETUNREACH, errno.EBADF, errno.EPIPE}
)


class CanLink:
    """Carry the frames of one driver; one thread only reads and writes, so nothing races."""

    def __init__(self, bus: can.BusABC, clock: Clock) -> None:
        self._bus = bus
        self._clock = clock
        self._watch = ControllerWatch()
        self._full_since_ns: int | None = None
        self._closed = False
        self.frames_sent = 0
        self.frames_received = 0
        self.frames_dropped = 0
        self.frames_malformed = 0

    @property
    def name(self) -> str:
        """Return what the bus is called in messages."""
        return str(self._bus.channel_info)

    @property
    def counters(self) -> dict[str, int]:
        """Return what was counted since the link was opened."""
        return {
            "sent": self.frames_sent,
            "received": self.frames_received,
            "dropped": self.frames_dropped,
            "malformed": self.frames_malformed,
            **self._watch.counters,
        }

    @property
    def controller(self) -> ControllerState:
        """Return the error state of the CAN controller, as far as error frames told it."""
        return self._watch.state

    @property
    def trouble(self) -> str:
        """Return what is wrong with the bus itself, in words; empty when nothing is known."""
        if self._full_since_ns is not None:
            full_ns = self._clock.now_ns() - self._full_since_ns
            if full_ns > STUCK_NS:
                return (
                    f"the transmit buffer is full since {full_ns / NS_PER_S:.1f} s: no other "
                    + ("node acknowledges; check wiring, termination and bit rate")
                )
        if self._watch.state is ControllerState.ACTIVE:
            return ""
        return f"the CAN controller is {self._watch.state.value}"

    def send(self, can_id: int, data: bytes = b"", *, remote: bool = False, dlc: int = 0) -> None:
        """Put one frame on the bus; a full transmit queue drops and counts it.

        Raises:
            LinkLost: the interface is down or gone.
        """
        message = can.Message(
            arbitration_id=can_id,
            is_extended_id=False,
            is_remote_frame=remote,
            dlc=dlc if remote else len(data),
            data=None if remote else data,
        )
        try:
            self._bus.send(message, timeout=0.0)
        except can.CanError as error:
            _raise_if_gone(error, self.name)
            self.frames_dropped += 1
            if self._full_since_ns is None:
                self._full_since_ns = self._clock.now_ns()
            return
        self._full_since_ns = None
        self.frames_sent += 1

    def drain(self) -> list[can.Message]:
        """Return the classic data frames that wait, at most `FRAMES_PER_DRAIN` of all kinds.

        Raises:
            BusOff: the controller has left the bus.
            LinkLost: the interface is down or gone.
        """
        frames: list[can.Message] = []
        for _ in range(FRAMES_PER_DRAIN):
            try:
                message = self._bus.recv(0.0)
            except (ProtocolError, ValueError, IndexError):
                # python-can reads the text of a serial adapter unchecked: noise ends in these.
                self.frames_malformed += 1
                continue
            except can.CanError as error:
                raise LinkLost(f"{self.name}: {error}") from error
            if message is None:
                break
            if self._ordinary(message):
                frames.append(message)
        return frames

    def _ordinary(self, message: can.Message) -> bool:
        self.frames_received += 1
        if message.is_error_frame:
            self._watch.take(message)
            if self._watch.state is ControllerState.BUS_OFF:
                raise BusOff(
                    f"{self.name}: bus-off, the controller has left the bus. Check wiring, "
                    "termination and bit rate; with `ip link set CHANNEL type can restart-ms 100` "
                    "the controller comes back by itself, and the drives are connected anew"
                )
        return not (
            message.is_error_frame
            or message.is_remote_frame
            or message.is_extended_id
            or message.is_fd
        )

    def close(self) -> None:
        """Leave the bus; leaving twice is allowed."""
        if self._closed:
            return
        self._closed = True
        try:
            self._bus.shutdown()
        except can.CanError:
            # An adapter that was pulled cannot take the command to close its channel.
            self.frames_dropped += 1


def _raise_if_gone(error: can.CanError, channel: str) -> None:
    if isinstance(error, LinkLost):
        raise error
    if error.error_code in _GONE:
        raise LinkLost(f"{channel}: {error}") from error
