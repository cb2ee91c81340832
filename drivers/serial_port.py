"""Talk to a tty: a USB adapter, an on-board UART, or the twin's pseudo-terminal."""

import array
import errno
import fcntl
import os
import select
import termios
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from drivers.errors import DeviceBusy, DeviceMissing, LinkLost

_SPEEDS: Final = {
    9_600: termios.B9600,
    57_600: termios.B57600,
    115_200: termios.B115200,
    230_400: termios.B230400,
    460_800: termios.B460800,
    921_600: termios.B921600,
    1_000_000: termios.B1000000,
    2_000_000: termios.B2000000,
    3_000_000: termios.B3000000,
    4_000_000: termios.B4000000,
}
_WRITE_PATIENCE_MS: Final = 50
_GONE: Final = frozenset({errno.EIO, errno.ENXIO, errno.ENODEV, errno.EBADF})
_OPEN_ERRORS: Final = {
    errno.ENOENT: (DeviceMissing, "plug the adapter in, or correct the path in the robot file"),
    errno.ENOTDIR: (DeviceMissing, "correct the path in the robot file"),
    errno.ENXIO: (DeviceMissing, "plug the adapter in again"),
    errno.EIO: (DeviceMissing, "the other end is closed; start what serves it"),
    errno.ENODEV: (DeviceMissing, "plug the adapter in again"),
    errno.EACCES: (DeviceMissing, "add the user to the group dialout and log in again"),
    errno.EBUSY: (DeviceBusy, "stop the process that holds it (see `fuser -v`)"),
    errno.EWOULDBLOCK: (DeviceBusy, "stop the process that holds it (see `fuser -v`)"),
    errno.ENOTTY: (DeviceMissing, "it is not a serial port: correct the path in the robot file"),
}
_ASYNC_LOW_LATENCY: Final = 1 << 13
_SERIAL_STRUCT_FLAGS: Final = 4


@contextmanager
def _mapped_open_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        kind, remedy = _OPEN_ERRORS.get(error.errno or 0, (DeviceMissing, "check the device"))
        raise kind(f"{path}: {error.strerror}; {remedy}") from error
    except termios.error as error:
        kind, remedy = _OPEN_ERRORS.get(error.args[0], (DeviceMissing, "check the device"))
        raise kind(f"{path}: {error.args[1]}; {remedy}") from error


class SerialPort:
    """Carry bytes over a tty, eight data bits, no parity, one stop bit.

    Reads wait in the kernel, never by spinning. The port is locked against other processes.
    """

    def __init__(self, path: Path, baud: int, clock: Clock) -> None:
        """Open and configure the port.

        Raises:
            ValueError: the baud rate is not one a tty offers.
            DeviceMissing: the path is not there, not permitted or not a tty.
            DeviceBusy: another process holds it.
        """
        if baud not in _SPEEDS:
            raise ValueError(f"{path}: baud must be one of {sorted(_SPEEDS)}, got {baud}")
        self._path = path
        self._clock = clock
        with _mapped_open_errors(path):
            self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
            try:
                fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _make_raw(self._fd, _SPEEDS[baud])
            except (OSError, termios.error):
                os.close(self._fd)
                raise
        self.low_latency = _request_low_latency(self._fd)
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLIN)

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the line.

        Raises:
            LinkLost: the adapter is gone, or took no byte for 50 ms.
        """
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                self._wait_writable()
            except OSError as error:
                raise self._lost(error) from error

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        """Return 1..max_bytes as soon as any have arrived, or b"" at `deadline_ns`.

        Raises:
            LinkLost: the adapter is gone.
        """
        while True:
            remaining_ns = deadline_ns - self._clock.now_ns()
            if not self._poll.poll(max(0.0, remaining_ns / 1e6)):
                return b""
            try:
                data = os.read(self._fd, max_bytes)
            except BlockingIOError:
                continue
            except OSError as error:
                raise self._lost(error) from error
            if not data:
                raise LinkLost(f"{self._path}: hung up; plug it in again, then reconnect")
            return data

    def discard_input(self) -> None:
        """Drop what has arrived and was not read.

        Raises:
            LinkLost: the adapter is gone.
        """
        try:
            termios.tcflush(self._fd, termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost(OSError(*error.args)) from error

    def close(self) -> None:
        """Release the port; closing twice is allowed."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _wait_writable(self) -> None:
        poll = select.poll()
        poll.register(self._fd, select.POLLOUT)
        if not poll.poll(_WRITE_PATIENCE_MS):
            raise LinkLost(
                f"{self._path}: took no byte for {_WRITE_PATIENCE_MS} ms; "
                "check that the adapter (or the process serving it) is alive, then reconnect"
            )

    def _lost(self, error: OSError) -> LinkLost:
        what = "unplugged" if error.errno in _GONE else "failed"
        return LinkLost(
            f"{self._path}: {what} ({error.strerror}); plug it in again, then reconnect"
        )


def _make_raw(fd: int, speed: int) -> None:
    """Configure 8N1 without any translation; VMIN 1 lets an empty read mean a hang-up."""
    _, _, _, _, _, _, characters = termios.tcgetattr(fd)
    characters[termios.VMIN] = 1
    characters[termios.VTIME] = 0
    flags = termios.CS8 | termios.CREAD | termios.CLOCAL
    termios.tcsetattr(fd, termios.TCSANOW, [0, 0, flags, 0, speed, speed, characters])
    termios.tcflush(fd, termios.TCIOFLUSH)


def _request_low_latency(fd: int) -> bool:
    """Ask the driver not to collect bytes (an FTDI chip waits 16 ms by default)."""
    settings = array.array("i", [0] * 32)
    try:
        fcntl.ioctl(fd, termios.TIOCGSERIAL, settings)
        settings[_SERIAL_STRUCT_FLAGS] |= _ASYNC_LOW_LATENCY
        fcntl.ioctl(fd, termios.TIOCSSERIAL, settings)
    except OSError:  # a pseudo-terminal or an adapter without the setting
        return False
    return True
