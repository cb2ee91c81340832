"""Carry CAN frames over a Unix socket where the kernel has no CAN: a python-can plug-in, `vla_hub`.

One SOCK_SEQPACKET packet is one frame: ordered, reliable, and the socket can be polled. The hub at
the other end passes each frame to all others, as a bus does; it never sends a frame back.

Received frames carry the seconds since the epoch at which they were read, as python-can's loggers
take them. The drivers pass over that stamp: their time is that of the clock they are given.
"""

import select
import socket
import struct
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Final

import can

from drivers.errors import LinkLost, ProtocolError

MAX_DATA_BYTES: Final = 64
_WIRE: Final = struct.Struct(f"<IBB{MAX_DATA_BYTES}s")
FRAME_BYTES: Final = _WIRE.size

_EXTENDED, _REMOTE, _ERROR, _FD, _RATE_SWITCH, _ERROR_STATE = (1 << bit for bit in range(6))


class HubLost(LinkLost, can.CanOperationError):  # type: ignore[misc]
    """Say that the CAN hub has closed the connection; python-can sees its own error class."""


def encode_frame(message: can.Message) -> bytes:
    """Pack a classic or FD frame into `FRAME_BYTES` bytes."""
    flags = (
        _EXTENDED * message.is_extended_id
        | _REMOTE * message.is_remote_frame
        | _ERROR * message.is_error_frame
        | _FD * message.is_fd
        | _RATE_SWITCH * message.bitrate_switch
        | _ERROR_STATE * message.error_state_indicator
    )
    return _WIRE.pack(message.arbitration_id, flags, message.dlc, bytes(message.data))


def epoch_s() -> float:
    """Return the seconds since the epoch, by the wall clock."""
    return datetime.now(UTC).timestamp()


def decode_frame(packet: bytes, stamp_s: float = 0.0) -> can.Message:
    """Unpack one packet into a frame.

    Raises:
        ProtocolError: the packet is not one frame.
    """
    if len(packet) != FRAME_BYTES:
        raise ProtocolError(f"CAN hub packet has {len(packet)} bytes, expected {FRAME_BYTES}")
    arbitration_id, flags, dlc, data = _WIRE.unpack(packet)
    limit_bytes = MAX_DATA_BYTES if flags & _FD else 8
    if dlc > limit_bytes:
        raise ProtocolError(f"CAN hub frame claims {dlc} data bytes, at most {limit_bytes} fit")
    return can.Message(
        timestamp=stamp_s,
        arbitration_id=arbitration_id,
        is_extended_id=bool(flags & _EXTENDED),
        is_remote_frame=bool(flags & _REMOTE),
        is_error_frame=bool(flags & _ERROR),
        is_fd=bool(flags & _FD),
        bitrate_switch=bool(flags & _RATE_SWITCH),
        error_state_indicator=bool(flags & _ERROR_STATE),
        dlc=dlc,
        data=None if flags & _REMOTE else data[:dlc],
    )


class HubBus(can.BusABC):  # type: ignore[misc]
    """Speak to the CAN hub that listens at the socket path `channel`."""

    def __init__(
        self,
        channel: str,
        can_filters: object = None,
        *,
        now_s: Callable[[], float] = epoch_s,
        **kwargs: object,
    ) -> None:
        """Connect to the hub; `now_s` stamps what is received.

        Raises:
            can.CanInitializationError: nothing listens at `channel`.
        """
        self.channel_info = f"CAN hub {channel}"
        self._now_s = now_s
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.connect(str(channel))
        except OSError as error:
            self._socket.close()
            raise can.CanInitializationError(
                f"{self.channel_info}: {error.strerror}; is the twin running?", error.errno
            ) from error
        self._socket.setblocking(False)
        super().__init__(channel=channel, can_filters=can_filters, **kwargs)

    def fileno(self) -> int:
        """Return the socket's descriptor; readable means that a frame waits."""
        return self._socket.fileno()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand one frame to the hub; like SocketCAN, no timeout means no waiting.

        Raises:
            can.CanTimeoutError: the hub does not take frames.
            HubLost: the hub has gone.
        """
        packet = encode_frame(msg)
        try:
            self._socket.send(packet)
        except BlockingIOError:
            self._send_later(packet, timeout or 0.0)
        except OSError as error:
            raise HubLost(f"{self.channel_info}: {error.strerror}") from error

    def _send_later(self, packet: bytes, timeout_s: float) -> None:
        _, writable, _ = select.select([], [self._socket], [], timeout_s)
        if not writable:
            raise can.CanTimeoutError(f"{self.channel_info}: takes no frames for {timeout_s:g} s")
        try:
            self._socket.send(packet)
        except OSError as error:
            raise HubLost(f"{self.channel_info}: {error.strerror}") from error

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        packet = self._receive()
        if packet is None and (timeout is None or timeout > 0.0):
            select.select([self._socket], [], [], timeout)
            packet = self._receive()
        return (None if packet is None else decode_frame(packet, self._now_s())), False

    def _receive(self) -> bytes | None:
        try:
            packet = self._socket.recv(FRAME_BYTES + 1)
        except BlockingIOError:
            return None
        except OSError as error:
            raise HubLost(f"{self.channel_info}: {error.strerror}") from error
        if not packet:
            raise HubLost(f"{self.channel_info}: closed by the hub")
        return packet

    def shutdown(self) -> None:
        """Leave the bus; leaving twice is allowed."""
        super().shutdown()
        self._socket.close()
