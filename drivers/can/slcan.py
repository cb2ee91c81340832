"""Speak to a serial CAN adapter (slcan, the Lawicel text protocol) without ever waiting.

python-can opens, sends and closes. Its receiving half reads byte by byte, trusts every line, and
ends at the adapter's acknowledgements, of which every sent frame has one; ours does not.
"""

import errno
import os
import select
from collections import deque
from typing import Final

import can
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus

from drivers.errors import ProtocolError

MAX_LINE_BYTES: Final = 32
MAX_BACKLOG_BYTES: Final = 1024
_END, _BELL = b"\r", b"\a"
# Kind of a frame's line: (digits of the identifier, extended, remote)
_KINDS: Final = {
    "t": (3, False, False),
    "T": (8, True, False),
    "r": (3, False, True),
    "R": (8, True, True),
}
_MAX_ID: Final = {3: 0x7FF, 8: 0x1FFF_FFFF}
TIMESTAMP_DIGITS: Final = 4
_HEX: Final = frozenset("0123456789abcdefABCDEF")


def parse_line(line: str) -> can.Message | None:
    """Return the frame of one line, None for an acknowledgement or another answer.

    Raises:
        ProtocolError: it begins like a frame and is none.
    """
    if not line or line[0] not in _KINDS:
        return None
    digits, extended, remote = _KINDS[line[0]]
    head, length = line[1 : 1 + digits], line[1 + digits : 2 + digits]
    if len(head) != digits or not _HEX.issuperset(head) or length not in set("012345678"):
        raise ProtocolError(f"slcan line {line[:MAX_LINE_BYTES]!r} is no frame")
    dlc, payload = int(length), line[2 + digits :]
    data_digits = 0 if remote else 2 * dlc
    valid = len(payload) in (data_digits, data_digits + TIMESTAMP_DIGITS)
    if not valid or not _HEX.issuperset(payload) or int(head, 16) > _MAX_ID[digits]:
        raise ProtocolError(f"slcan line {line[:MAX_LINE_BYTES]!r} is no frame")
    return can.Message(
        arbitration_id=int(head, 16),
        is_extended_id=extended,
        is_remote_frame=remote,
        dlc=dlc,
        data=None if remote else bytes.fromhex(payload[:data_digits]),
    )


def format_line(frame: can.Message) -> str:
    """Return the line of a classic frame, without its end."""
    kind, digits = ("r" if frame.is_remote_frame else "t"), 3
    if frame.is_extended_id:
        kind, digits = kind.upper(), 8
    data = "" if frame.is_remote_frame else bytes(frame.data).hex().upper()
    return f"{kind}{frame.arbitration_id:0{digits}X}{frame.dlc:d}{data}"


class SerialCanBus(slcanBus):  # type: ignore[misc]
    """Be python-can's slcan bus with a receiving half fit for a control loop.

    `frames_refused` counts what the adapter did not take, such as with a full transmit buffer.
    """

    def __init__(self, path: str, bitrate: int) -> None:
        """Open the adapter's channel at a bit rate.

        Raises:
            can.CanInitializationError: the path is no terminal or cannot be opened.
            ValueError: the adapter has no such bit rate.
        """
        self.frames_refused = 0
        self._text = bytearray()
        self._backlog = bytearray()
        self._waiting: deque[can.Message] = deque()
        # The default waits two seconds, for boards that reset when they are opened.
        super().__init__(path, bitrate=bitrate, sleep_after_open=0.0, timeout=0.0)
        self.channel_info = f"CAN adapter {path}"

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self._waiting:
            self._read_lines()
        if not self._waiting and (timeout is None or timeout > 0.0):
            select.select([self.fileno()], [], [], timeout)
            self._read_lines()
        return (self._waiting.popleft() if self._waiting else None), False

    def _write(self, string: str) -> None:
        """Hand over a line as far as the terminal takes it now; the rest goes with the next one."""
        if len(self._backlog) > MAX_BACKLOG_BYTES:
            raise can.CanOperationError("transmit buffer full", errno.ENOBUFS)
        self._backlog += string.encode("ascii") + _END
        try:
            with error_check("Could not write to serial device"):
                del self._backlog[: os.write(self.fileno(), self._backlog)]
        except can.CanOperationError as error:
            if not isinstance(error.__cause__, BlockingIOError):
                raise

    def _read_lines(self) -> None:
        """Take in whole lines; one that is no frame ends the reading with its error.

        Raises:
            ProtocolError: a line is no frame; what follows it is kept for the next call.
        """
        with error_check("Could not read from serial device"):
            self._text += self.serialPortOrig.read(self.serialPortOrig.in_waiting)
        self.frames_refused += self._text.count(_BELL)
        self._text = self._text.replace(_BELL, b"")
        while (end := self._text.find(_END)) >= 0:
            line = bytes(self._text[:end])
            del self._text[: end + 1]
            frame = parse_line(line.decode("ascii", errors="replace"))
            if frame is not None:
                self._waiting.append(frame)
        if len(self._text) > MAX_LINE_BYTES:
            self._text.clear()
            raise ProtocolError(f"slcan: more than {MAX_LINE_BYTES} bytes without an end of line")
