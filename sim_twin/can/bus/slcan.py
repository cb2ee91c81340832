"""Emulate a serial CAN adapter (slcan, the Lawicel text protocol) on the wire, behind a terminal.

`PtyLine(SlcanAdapter(wire), path)` makes it a terminal that any slcan tool can open.
"""

from typing import Final

import can

from sim_twin.can.bus.wire import CanWire

OK, BELL = b"\r", b"\a"
MAX_LINE_BYTES: Final = 64
MAX_OUTPUT_BYTES: Final = 4096
VERSION: Final = b"V1013\r"
SERIAL_NUMBER: Final = b"NTWIN\r"
BITRATES: Final = dict(
    zip(
        b"012345678",
        (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000),
        strict=True,
    )
)
# Kind of a frame's line: (digits of the identifier, extended, remote, its acknowledgement)
_KINDS: Final = {
    ord("t"): (3, False, False, b"z\r"),
    ord("T"): (8, True, False, b"Z\r"),
    ord("r"): (3, False, True, b"z\r"),
    ord("R"): (8, True, True, b"Z\r"),
}


class SlcanAdapter:
    """Turn lines of text into frames and back; a closed channel neither sends nor hears."""

    def __init__(self, wire: CanWire) -> None:
        self.frames_dropped = 0
        self.bitrate = 0
        self._wire = wire
        self._input = bytearray()
        self._output = bytearray()
        self._open = False
        self._listen_only = False
        self._port = self._hear
        wire.attach(self._port)

    def receive(self, data: bytes) -> None:
        """Take bytes of the host."""
        self._input += data
        while (end := self._input.find(OK)) >= 0:
            line = bytes(self._input[:end])
            del self._input[: end + 1]
            self._output += self._answer(line)
        if len(self._input) > MAX_LINE_BYTES:
            self._input.clear()
            self._output += BELL

    def transmit(self) -> bytes:
        """Return what is ready for the host."""
        ready, self._output = bytes(self._output), bytearray()
        return ready

    def step(self, now_ns: int) -> None:
        """Follow simulated time."""
        self._wire.poll(now_ns)

    def _answer(self, line: bytes) -> bytes:
        match line[:1]:
            case b"":
                return OK
            case b"S":
                return self._set_bitrate(line)
            case b"O" | b"L":
                self._open, self._listen_only = True, line[:1] == b"L"
                self._wire.set_wrong_bitrate(self._port, self.bitrate != self._wire.bitrate)
                return OK
            case b"C":
                self._open = False
                return OK
            case b"V":
                return VERSION
            case b"N":
                return SERIAL_NUMBER
        return self._send(line)

    def _set_bitrate(self, line: bytes) -> bytes:
        if self._open or len(line) != 2 or line[1] not in BITRATES:
            return BELL
        self.bitrate = BITRATES[line[1]]
        return OK

    def _send(self, line: bytes) -> bytes:
        if line[0] not in _KINDS or not self._open or self._listen_only:
            return BELL
        digits, extended, remote, acknowledged = _KINDS[line[0]]
        try:
            can_id, dlc = int(line[1 : 1 + digits], 16), int(line[1 + digits : 2 + digits])
            data = None if remote else bytes.fromhex(line[2 + digits :].decode("ascii"))
            frame = can.Message(
                arbitration_id=can_id,
                is_extended_id=extended,
                is_remote_frame=remote,
                dlc=dlc,
                data=data,
                check=True,
            )
        except ValueError:
            return BELL
        return acknowledged if self._wire.send(frame, self._port) else BELL

    def _hear(self, frame: can.Message) -> None:
        if not self._open or frame.is_error_frame or frame.is_fd:
            return
        if len(self._output) > MAX_OUTPUT_BYTES:
            self.frames_dropped += 1
            return
        kind = "r" if frame.is_remote_frame else "t"
        digits = 3
        if frame.is_extended_id:
            kind, digits = kind.upper(), 8
        data = "" if frame.is_remote_frame else bytes(frame.data).hex().upper()
        self._output += f"{kind}{frame.arbitration_id:0{digits}X}{frame.dlc:d}{data}\r".encode()
