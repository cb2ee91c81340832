"""Record what passes over a wire, for a look at it later or a replay.

Each record reaches the kernel by one write, so that a killed process loses nothing that it has
recorded. When the file has grown to half of its bound it becomes the older part, `<path>.1`, and a
new one begins: the newest traffic is always there, and the two together never exceed the bound.
A recorder that cannot write any more (a full disk) says so once and stops; the wire goes on.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import can

from drivers.base import BurstTransport, ByteTransport, CheckedTransport, TunableTransport
from drivers.clock import Clock
from drivers.errors import DeviceMissing, LinkLost
from drivers.recording.recording import (
    MAGIC,
    MAX_PAYLOAD_BYTES,
    RecordKind,
    encode_can,
    encode_record,
    older_part,
)

DEFAULT_MAX_BYTES: Final = 64 * 1024 * 1024
"""Some ten minutes of a bus of 16 servos at 250 Hz."""
MIN_MAX_BYTES: Final = 4 * MAX_PAYLOAD_BYTES
_log = logging.getLogger(__name__)


class WireRecorder:
    """Append records to a file that never outgrows its bound; an earlier recording is replaced."""

    def __init__(
        self, path: Path, clock: Clock, *, note: str = "", max_bytes: int = DEFAULT_MAX_BYTES
    ) -> None:
        """Start a recording.

        Raises:
            ValueError: the bound is too small to hold records.
            DeviceMissing: the file cannot be created.
        """
        if max_bytes < MIN_MAX_BYTES:
            raise ValueError(f"a recording needs at least {MIN_MAX_BYTES} bytes, got {max_bytes}")
        self._path = path
        self._clock = clock
        self._note = note
        self._part_bytes = max_bytes // 2
        older_part(path).unlink(missing_ok=True)
        try:
            self._fd = self._begin()
        except OSError as error:
            raise DeviceMissing(
                f"cannot record to {path}: {error.strerror}; choose another file"
            ) from error

    def record(self, kind: RecordKind, payload: bytes) -> None:
        """Append one record, stamped now; a payload too long for one becomes several."""
        if self._fd < 0:
            return
        try:
            for start in range(0, max(len(payload), 1), MAX_PAYLOAD_BYTES):
                self._append(kind, payload[start : start + MAX_PAYLOAD_BYTES])
        except OSError as error:
            _log.warning("%s: recording ended: %s", self._path, error.strerror)
            self.close()

    def close(self) -> None:
        """End the recording; closing twice is allowed."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _append(self, kind: RecordKind, payload: bytes) -> None:
        record = encode_record(kind, self._clock.now_ns(), payload)
        if self._size + len(record) > self._part_bytes:
            os.close(self._fd)
            self._path.replace(older_part(self._path))
            self._fd = self._begin()
        self._size += os.write(self._fd, record)

    def _begin(self) -> int:
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_CLOEXEC
        fd = os.open(self._path, flags, 0o644)
        head = MAGIC
        if self._note:
            note = self._note.encode()[:MAX_PAYLOAD_BYTES]
            head += encode_record(RecordKind.NOTE, self._clock.now_ns(), note)
        self._size = os.write(fd, head)
        return fd


class RecordingTransport:
    """Be a `ByteTransport` that records what passes through it.

    It offers bursts, other speeds and a look at the adapter as far as the transport behind it does.
    """

    def __init__(self, transport: ByteTransport, recorder: WireRecorder) -> None:
        self._transport = transport
        self._recorder = recorder

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the line.

        Raises:
            LinkLost: the other end has gone.
        """
        self._recorder.record(RecordKind.WRITE, data)
        with self._recorded_loss():
            self._transport.write(data)

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes as soon as any have arrived, or b"" at `deadline_ns`.

        Raises:
            LinkLost: the other end has gone.
        """
        with self._recorded_loss():
            data = self._transport.read(max_bytes, deadline_ns)
        return self._recorded(data)

    def read_burst(self, count: int, due_ns: int, deadline_ns: int) -> bytes:
        """Return `count` bytes, or what of them has arrived by `deadline_ns`.

        Raises:
            LinkLost: the other end has gone.
        """
        if isinstance(self._transport, BurstTransport):
            with self._recorded_loss():
                return self._recorded(self._transport.read_burst(count, due_ns, deadline_ns))
        data = b""
        while len(data) < count:
            more = self.read(count - len(data), deadline_ns)
            if not more:
                break
            data += more
        return data

    @property
    def bauds(self) -> tuple[int, ...]:
        """Return the speeds on offer."""
        inner = self._transport
        return inner.bauds if isinstance(inner, TunableTransport) else ()

    def set_baud(self, baud: int) -> None:
        """Go on at another speed; a note says so.

        Raises:
            ValueError: the speed is none of `bauds`.
            LinkLost: the other end has gone.
        """
        if not isinstance(self._transport, TunableTransport):
            raise ValueError(f"this line has one speed only, got {baud} baud")
        self._transport.set_baud(baud)
        self._recorder.record(RecordKind.NOTE, f"{baud} baud from here".encode())

    def adapter_fault(self) -> str:
        """Return what slows the adapter down and how to mend it, or "" when nothing does."""
        inner = self._transport
        return inner.adapter_fault() if isinstance(inner, CheckedTransport) else ""

    def discard_input(self) -> None:
        """Drop what has arrived and was not read; it is not recorded."""
        self._transport.discard_input()

    def close(self) -> None:
        """Release the device and end the recording."""
        self._transport.close()
        self._recorder.close()

    def _recorded(self, data: bytes) -> bytes:
        if data:
            self._recorder.record(RecordKind.READ, data)
        return data

    @contextmanager
    def _recorded_loss(self) -> Iterator[None]:
        try:
            yield
        except LinkLost as error:
            self._recorder.record(RecordKind.LOST, str(error).encode())
            raise


class RecordingCanBus(can.BusABC):  # type: ignore[misc]
    """Be a python-can bus that records the frames of another."""

    def __init__(self, bus: can.BusABC, recorder: WireRecorder) -> None:
        self._bus = bus
        self._recorder = recorder
        self.channel_info = f"{bus.channel_info}, recorded"
        super().__init__(channel=None)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame.

        Raises:
            can.CanError: the bus does not take it.
        """
        self._recorder.record(RecordKind.CAN_SENT, encode_can(msg))
        self._bus.send(msg, timeout)

    def fileno(self) -> int:
        """Return what tells that a frame waits."""
        return int(self._bus.fileno())

    def shutdown(self) -> None:
        """Leave the bus and end the recording; leaving twice is allowed."""
        super().shutdown()
        self._bus.shutdown()
        self._recorder.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        message, filtered = self._bus._recv_internal(timeout)
        if message is not None:
            self._recorder.record(RecordKind.CAN_RECEIVED, encode_can(message))
        return message, filtered
