"""Talk to a Linux input device: `/dev/input/by-id/...-event-kbd` and the like.

What is read begins with one report of every key's present state: the kernel tells changes only.
"""

import fcntl
import os
import select
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, Protocol

from drivers.clock import Clock, waiter_of
from drivers.errors import DeviceBusy, DeviceMissing, LinkLost
from drivers.estop.input_event import EventType, key_report

_INT: Final = struct.Struct("@i")
KEY_BITS: Final = 0x300
_KEY_BYTES: Final = KEY_BITS // 8
_READ: Final = 2 << 30
_WRITE: Final = 1 << 30
_KIND: Final = ord("E") << 8
EVIOCGKEY: Final = _READ | _KEY_BYTES << 16 | _KIND | 0x18
EVIOCGBIT_KEY: Final = _READ | _KEY_BYTES << 16 | _KIND | (0x20 + EventType.KEY)
_AXIS_INFO: Final = struct.Struct("@6i")
"""Value, minimum, maximum, fuzz, flat, resolution: struct input_absinfo."""
EVIOCGABS: Final = _READ | _AXIS_INFO.size << 16 | _KIND | 0x40
"""Of axis 0; that of axis n is n more."""
EVIOCGRAB: Final = _WRITE | 4 << 16 | _KIND | 0x90
EVIOCSCLOCKID: Final = _WRITE | 4 << 16 | _KIND | 0xA0
_REMEDIES: Final = {
    FileNotFoundError: "plug the button in, or correct the path in the robot file",
    PermissionError: "add the user to the group input and log in again",
}


class Ioctl(Protocol):
    """Ask the kernel about a device, as `fcntl.ioctl` does."""

    def __call__(self, fd: int, request: int, argument: bytearray, /) -> int:
        """Fill or apply `argument`."""
        ...


class InputDevice:
    """Carry input events from one device; with `grab` nobody else gets them."""

    def __init__(
        self, path: Path, clock: Clock, *, grab: bool = False, ioctl: Ioctl = fcntl.ioctl
    ) -> None:
        """Open the device and ask for its keys.

        Raises:
            DeviceMissing: the path is not there, not permitted or no input device.
            DeviceBusy: another process has grabbed it.
        """
        self._path = path
        self._clock = clock
        self._ioctl = ioctl
        try:
            self._fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            remedy = _REMEDIES.get(type(error), "check the device")
            raise DeviceMissing(f"{path}: {error.strerror}; {remedy}") from error
        self._pending = b""
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLIN)
        self._wait_readable = waiter_of(clock)
        self._set_up(grab)

    def write(self, data: bytes) -> None:
        """Refuse: a button takes no data.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError(f"{self._path}: a button takes no data")

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return whole events as soon as any have arrived, or b"" at `deadline_ns`.

        Raises:
            LinkLost: the device is gone.
        """
        if self._pending:
            data, self._pending = self._pending[:max_bytes], self._pending[max_bytes:]
            return data
        if not self._wait_readable(self._poll, deadline_ns):
            return b""
        try:
            data = os.read(self._fd, max_bytes)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error
        if not data:
            raise self._lost("hung up")
        return data

    def axis_range(self, axis: int) -> tuple[int, int]:
        """Return the least and the greatest value of an axis, such as that of a stick.

        Raises:
            LinkLost: the device is gone, or has no such axis.
        """
        info = bytearray(_AXIS_INFO.size)
        try:
            self._ask(EVIOCGABS + axis, info)
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error
        _, low, high, *_ = _AXIS_INFO.unpack(info)
        return low, high

    def discard_input(self) -> None:
        """Drop what has arrived and was not read.

        Raises:
            LinkLost: the device is gone.
        """
        while self.read(4096, 0):
            pass

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _set_up(self, grab: bool) -> None:
        try:
            self._ask(EVIOCSCLOCKID, bytearray(_INT.pack(time.CLOCK_MONOTONIC)))
            self._pending = b"".join(self._state())
            if grab:
                self._grab()
        except OSError as error:
            self.close()
            raise DeviceMissing(
                f"{self._path}: not an input device ({error.strerror}); "
                "give a path under /dev/input/by-id in the robot file"
            ) from error
        except DeviceBusy:
            self.close()
            raise

    def _grab(self) -> None:
        try:
            self._ask(EVIOCGRAB, bytearray(_INT.pack(1)))
        except OSError as error:
            raise DeviceBusy(
                f"{self._path}: {error.strerror}; stop the process that has grabbed it"
            ) from error

    def _state(self) -> Iterator[bytes]:
        """Yield a report of each key that the device has."""
        present = self._bits(EVIOCGBIT_KEY)
        down = self._bits(EVIOCGKEY)
        now_ns = self._clock.now_ns()
        for code in range(KEY_BITS):
            if present(code):
                yield key_report(code, down=down(code), now_ns=now_ns)

    def _bits(self, request: int) -> Callable[[int], bool]:
        bits = bytearray(_KEY_BYTES)
        self._ask(request, bits)
        return lambda code: bool(bits[code // 8] >> code % 8 & 1)

    def _ask(self, request: int, argument: bytearray) -> None:
        self._ioctl(self._fd, request, argument)

    def _lost(self, reason: str) -> LinkLost:
        return LinkLost(f"{self._path}: {reason}; plug the button in again")
