"""Emulate a serial CAN adapter (slcan, the Lawicel text protocol) on the wire, behind a terminal.

`PtyLine(SlcanAdapter(wire), path)` makes it a terminal that any slcan tool can open. Commands and
answers are those of Lawicel's CAN232 and CANUSB manuals.
"""

from collections.abc import Callable, Mapping
from enum import IntFlag
from typing import Final

import can

from drivers.can.slcan import format_line, parse_line
from drivers.errors import ProtocolError
from sim_twin.can.bus.error_counters import ErrorState
from sim_twin.can.bus.wire import CanWire

OK, BELL = b"\r", b"\a"
MAX_LINE_BYTES: Final = 64
MAX_OUTPUT_BYTES: Final = 4096
VERSION: Final = b"V1013\r"
SERIAL_NUMBER: Final = b"NTWIN\r"
STAMP_PERIOD_MS: Final = 60_000
_NS_PER_MS: Final = 1_000_000
BITRATES: Final = dict(
    zip(
        b"012345678",
        (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000),
        strict=True,
    )
)


class SlcanFlag(IntFlag):
    """Name the bits of the answer to F, which clears them; warning and passive are states."""

    TRANSMIT_FULL = 0x02
    ERROR_WARNING = 0x04
    DATA_OVERRUN = 0x08
    ERROR_PASSIVE = 0x20
    BUS_ERROR = 0x80


class SlcanAdapter:
    """Turn lines of text into frames and back.

    While its channel is closed, the adapter is not on the bus: it neither sends, hears nor
    acknowledges.
    """

    def __init__(self, wire: CanWire) -> None:
        self.frames_dropped = 0
        self.bitrate: int | None = None
        self._wire = wire
        self._input = bytearray()
        self._overlong = False
        self._output = bytearray()
        self._open = False
        self._listen_only = False
        self._stamped = False
        self._flags = SlcanFlag(0)
        self._port = self._hear

    def receive(self, data: bytes) -> None:
        """Take bytes of the host."""
        self._input += data
        while (end := self._input.find(OK)) >= 0:
            line = bytes(self._input[:end])
            del self._input[: end + 1]
            refused = self._overlong or len(line) > MAX_LINE_BYTES
            self._output += BELL if refused else self._answer(line)
            self._overlong = False
        if len(self._input) > MAX_LINE_BYTES:
            # The rest of such a line, up to its end, must not pass for a line of its own.
            self._input.clear()
            self._overlong = True

    def transmit(self) -> bytes:
        """Return what is ready for the host."""
        ready, self._output = bytes(self._output), bytearray()
        return ready

    def step(self, now_ns: int) -> None:
        """Follow simulated time."""
        self._wire.poll(now_ns)

    def _answer(self, line: bytes) -> bytes:
        if not line:
            return OK
        command = _COMMANDS.get(line[:1])
        return self._send(line) if command is None else command(self, line)

    def _set_bitrate(self, line: bytes) -> bytes:
        if self._open or len(line) != 2 or line[1] not in BITRATES:
            return BELL
        self.bitrate = BITRATES[line[1]]
        return OK

    def _set_stamps(self, line: bytes) -> bytes:
        if self._open or line not in (b"Z0", b"Z1"):
            return BELL
        self._stamped = line == b"Z1"
        return OK

    def _open_channel(self, line: bytes) -> bytes:
        if self._open or self.bitrate is None or len(line) != 1:
            return BELL
        self._open, self._listen_only = True, line == b"L"
        self._flags = SlcanFlag(0)
        self._wire.attach(self._port)
        self._wire.set_wrong_bitrate(self._port, self.bitrate != self._wire.bitrate)
        return OK

    def _close_channel(self, line: bytes) -> bytes:
        """Close also what is closed, since hosts begin with that; Lawicel's own rings a bell."""
        if len(line) != 1:
            return BELL
        if self._open:
            self._open = False
            self._wire.detach(self._port)
        return OK

    def _tell_flags(self, line: bytes) -> bytes:
        if not self._open or len(line) != 1:
            return BELL
        state = self._wire.health(self._port).state
        flags = self._flags
        flags |= SlcanFlag.ERROR_WARNING if state >= ErrorState.WARNING else 0
        flags |= SlcanFlag.ERROR_PASSIVE if state >= ErrorState.PASSIVE else 0
        self._flags = SlcanFlag(0)
        return f"F{flags:02X}\r".encode()

    def _send(self, line: bytes) -> bytes:
        if not self._open or self._listen_only:
            return BELL
        text = line.decode("ascii", errors="replace")
        try:
            frame = parse_line(text)
        except ProtocolError:
            return BELL
        # Only adapters put a time stamp behind a frame: a host's line is the frame and no more.
        if frame is None or format_line(frame)[1:] != text[1:].upper():
            return BELL
        if not self._wire.send(frame, self._port):
            self._flags |= SlcanFlag.TRANSMIT_FULL
            return BELL
        return b"Z\r" if frame.is_extended_id else b"z\r"

    def _hear(self, frame: can.Message) -> None:
        if frame.is_error_frame:
            self._flags |= SlcanFlag.BUS_ERROR
        if not self._open or frame.is_error_frame or frame.is_fd:
            return
        if len(self._output) > MAX_OUTPUT_BYTES:
            self.frames_dropped += 1
            self._flags |= SlcanFlag.DATA_OVERRUN
            return
        stamp = ""
        if self._stamped:
            stamp = f"{self._wire.now_ns // _NS_PER_MS % STAMP_PERIOD_MS:04X}"
        self._output += f"{format_line(frame)}{stamp}\r".encode()


_COMMANDS: Final[Mapping[bytes, Callable[[SlcanAdapter, bytes], bytes]]] = {
    b"S": SlcanAdapter._set_bitrate,
    b"Z": SlcanAdapter._set_stamps,
    b"O": SlcanAdapter._open_channel,
    b"L": SlcanAdapter._open_channel,
    b"C": SlcanAdapter._close_channel,
    b"F": SlcanAdapter._tell_flags,
    b"V": lambda adapter, line: VERSION if len(line) == 1 else BELL,
    b"N": lambda adapter, line: SERIAL_NUMBER if len(line) == 1 else BELL,
}
