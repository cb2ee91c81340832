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

from drivers.clock import Clock, waiter_of
from drivers.errors import DeviceBusy, DeviceMissing, LinkLost

_SPEEDS: Final = {
    9_600: termios.B9600,
    57_600: termios.B57600,
    115_200: termios.B115200,
    230_400: termios.B230400,
    460_800: termios.B460800,
    500_000: termios.B500000,
    921_600: termios.B921600,
    1_000_000: termios.B1000000,
    2_000_000: termios.B2000000,
    3_000_000: termios.B3000000,
    4_000_000: termios.B4000000,
}
_WRITE_PATIENCE_MS: Final = 50
_WAKE_EARLY_NS: Final = 20_000
"""How long before the last byte is due a sleep ends: timers are late by some 60 us."""
_LATER_NS: Final = 20_000
_EARLIER_NS: Final = 2_000
_LATEST_NS: Final = 1_000_000
"""At leisure a sleep lasts until all bytes are there, so that one look is enough: by how much the
next one is longer where some were missing, by how much shorter where not, and the most of it."""
_NAPS: Final = 50
"""How often a line that was slow is slept through before it is watched again."""
_MOST_LATENCY_MS: Final = 1
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

    def __init__(
        self, path: Path, baud: int, clock: Clock, *, sysfs_root: Path = Path("/sys")
    ) -> None:
        """Open and configure the port.

        Raises:
            ValueError: the baud rate is not one a tty offers.
            DeviceMissing: the path is not there, not permitted or not a tty.
            DeviceBusy: another process holds it.
        """
        self._path = path
        speed = self._speed(baud)
        self._clock = clock
        self._sysfs_root = sysfs_root
        self._naps = 0
        self._late_ns = 0
        self._burst_end_ns = clock.now_ns()
        with _mapped_open_errors(path):
            self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
            try:
                fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _make_raw(self._fd, speed)
            except (OSError, termios.error):
                os.close(self._fd)
                raise
        self.low_latency = _request_low_latency(self._fd)
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLIN)
        self._wait_readable = waiter_of(clock)

    def write(self, data: bytes) -> None:
        """Hand all of `data` to the line.

        Raises:
            LinkLost: the adapter is gone, or took no byte for 50 ms.
        """
        while data:
            try:
                taken = os.write(self._fd, data)
                if taken == len(data):
                    return
                data = data[taken:]
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
            if not self._wait_readable(self._poll, deadline_ns):
                return b""
            data = self._read_now(max_bytes)
            if data:
                return data

    def read_burst(self, count: int, due_ns: int, deadline_ns: int) -> bytes:
        """Return `count` bytes, or what of them has arrived by `deadline_ns`, with few wake-ups.

        Where bytes have been seen to take their time on the wire, it is slept until `due_ns`. A
        port that was idle for longer than the burst takes has leisure: it sleeps a little longer.

        Raises:
            LinkLost: the adapter is gone.
        """
        data = self._nap(count, due_ns, deadline_ns) if self._naps else b""
        while len(data) < count:
            more = self.read(count - len(data), deadline_ns)
            if not more:
                break
            data += more
            if len(data) < count:
                self._naps = _NAPS
                data += self._nap(count - len(data), due_ns, deadline_ns)
        self._burst_end_ns = self._clock.now_ns()
        return data

    @property
    def bauds(self) -> tuple[int, ...]:
        """Return the speeds on offer."""
        return tuple(_SPEEDS)

    def set_baud(self, baud: int) -> None:
        """Go on at another speed; what was not read is dropped.

        Raises:
            ValueError: the speed is none of `bauds`.
            LinkLost: the adapter is gone.
        """
        speed = self._speed(baud)
        try:
            _make_raw(self._fd, speed)
        except termios.error as error:
            raise self._lost(OSError(*error.args)) from error

    def adapter_fault(self) -> str:
        """Return what makes the adapter hold back bytes and how to mend it, or "" if nothing does.

        An FTDI chip passes on what it has received when its buffer is full or its timer is over;
        the low-latency flag makes its driver set the timer to 1 ms, whatever the file says.
        """
        if self.low_latency:
            return ""
        timer = self._sysfs_root / "bus/usb-serial/devices" / self._path.resolve().name
        timer /= "latency_timer"
        try:
            latency_ms = int(timer.read_text())
        except (OSError, ValueError):  # not an FTDI adapter
            return ""
        if latency_ms <= _MOST_LATENCY_MS:
            return ""
        return (
            f"{self._path}: the adapter's latency timer is expected to be {_MOST_LATENCY_MS} ms, "
            f"got {latency_ms} ms, which bounds the bus to some {1000 // (latency_ms + 2)} Hz; "
            f"`echo {_MOST_LATENCY_MS} | sudo tee {timer}`, or install the udev rule of the docs"
        )

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

    def _speed(self, baud: int) -> int:
        if baud not in _SPEEDS:
            raise ValueError(f"{self._path}: baud must be one of {sorted(_SPEEDS)}, got {baud}")
        return _SPEEDS[baud]

    def _read_now(self, max_bytes: int) -> bytes:
        try:
            data = os.read(self._fd, max_bytes)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise LinkLost(f"{self._path}: hung up; plug it in again, then reconnect")
        return data

    def _nap(self, max_bytes: int, due_ns: int, deadline_ns: int) -> bytes:
        """Sleep until the bytes should be there and return those that are."""
        self._naps -= 1
        now_ns = self._clock.now_ns()
        wake_ns = due_ns - _WAKE_EARLY_NS
        if wake_ns <= now_ns:
            return b""
        if now_ns - self._burst_end_ns > due_ns - now_ns:
            return self._sleep_in(max_bytes, due_ns, deadline_ns)
        self._clock.sleep_until(wake_ns)
        return self._read_now(max_bytes)

    def _sleep_in(self, max_bytes: int, due_ns: int, deadline_ns: int) -> bytes:
        """Sleep for as long as the bytes before took, and learn from what is there."""
        self._clock.sleep_until(min(due_ns + self._late_ns, deadline_ns))
        data = self._read_now(max_bytes)
        learnt_ns = -_EARLIER_NS if len(data) == max_bytes else _LATER_NS
        self._late_ns = min(max(self._late_ns + learnt_ns, 0), _LATEST_NS)
        return data

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
