import os
import select
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from drivers.errors import LinkLost
from drivers.serial_port import SerialPort
from sim_twin.ports.pty_line import PtyLine

EVERY_BYTE = bytes(range(256))


class Echo:
    """A device that sends back what it got, and drops what was ready when asked too late."""

    def __init__(self) -> None:
        self.ready = b""

    def receive(self, data: bytes) -> None:
        self.ready += data

    def transmit(self) -> bytes:
        ready, self.ready = self.ready, b""
        return ready

    def step(self, now_ns: int) -> None:
        """Send nothing unasked."""


@pytest.fixture
def device() -> Echo:
    return Echo()


@pytest.fixture
def line(device: Echo, tmp_path: Path) -> Iterator[PtyLine]:
    line = PtyLine(device, tmp_path / "dev" / "servos")
    yield line
    line.close()


def open_host(line: PtyLine) -> int:
    return os.open(line.link_path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


@pytest.fixture
def host(line: PtyLine) -> Iterator[int]:
    host = open_host(line)
    yield host
    os.close(host)


def readable(descriptor: int, timeout_ms: int) -> bool:
    poller = select.poll()
    poller.register(descriptor, select.POLLIN)
    return bool(poller.poll(timeout_ms))


def test_every_byte_passes_unchanged_in_both_directions(line: PtyLine, host: int) -> None:
    os.write(host, EVERY_BYTE)
    assert readable(line.fileno(), 1000)
    assert line.poll_once()
    assert readable(host, 1000)
    assert os.read(host, 4096) == EVERY_BYTE


def test_a_line_without_bytes_is_idle_also_before_and_after_a_host(line: PtyLine) -> None:
    assert not readable(line.fileno(), 0)
    assert not line.poll_once()
    os.close(open_host(line))
    assert not readable(line.fileno(), 10)
    assert not line.poll_once()


def test_what_is_ready_is_sent_without_hearing_the_host(
    line: PtyLine, host: int, device: Echo
) -> None:
    os.write(host, b"asked")
    device.ready = b"reported"
    assert line.send_once()
    assert readable(host, 1000)
    assert os.read(host, 4096) == b"reported"
    assert not line.send_once()
    assert line.poll_once()
    assert os.read(host, 4096) == b"asked"


def test_unread_bytes_are_lost_and_counted(line: PtyLine, device: Echo) -> None:
    for _ in range(200):
        device.ready = EVERY_BYTE
        line.poll_once()
    assert line.lost_bytes > 0
    host = open_host(line)
    received = 0
    while readable(host, 50):
        received += len(os.read(host, 65_536))
    assert received + line.lost_bytes == 200 * len(EVERY_BYTE)
    os.close(host)


def test_unplugging_ends_the_hosts_session_and_removes_the_path(line: PtyLine, host: int) -> None:
    line.unplug()
    with pytest.raises(OSError, match="Input/output error"):
        os.write(host, b"x")
    assert not line.link_path.is_symlink()
    with pytest.raises(LinkLost, match="unplugged"):
        line.poll_once()


def test_replugging_gives_a_fresh_terminal_behind_the_same_path(
    line: PtyLine, host: int, device: Echo
) -> None:
    line.unplug()
    device.ready = b"stale"
    line.replug()
    fresh = open_host(line)
    os.write(fresh, b"hello")
    assert readable(line.fileno(), 1000)
    line.poll_once()
    assert readable(fresh, 1000)
    assert os.read(fresh, 64) == b"hello"
    os.close(fresh)


def test_a_stale_link_is_replaced(device: Echo, tmp_path: Path) -> None:
    path = tmp_path / "servos"
    path.symlink_to("/dev/pts/gone")
    line = PtyLine(device, path)
    assert path.resolve().is_char_device()
    line.close()
    line.close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("baud", [9_600, 57_600, 1_000_000, 4_000_000])
def test_the_speed_set_by_the_host_is_reported_before_its_bytes(
    device: Echo, tmp_path: Path, baud: int
) -> None:
    reported: list[tuple[int, bytes]] = []
    line = PtyLine(
        device, tmp_path / "servos", on_baud=lambda rate: reported.append((rate, device.ready))
    )
    port = SerialPort(line.link_path, baud, MonotonicClock())
    port.write(b"x")
    assert readable(line.fileno(), 1000)
    line.poll_once()
    assert reported == [(baud, b"")]
    port.close()
    line.close()


def test_a_speed_without_a_constant_is_reported_too(device: Echo, tmp_path: Path) -> None:
    serial = pytest.importorskip("serial")
    reported: list[int] = []
    line = PtyLine(device, tmp_path / "servos", on_baud=reported.append)
    assert not hasattr(termios, "B4500000")
    with serial.Serial(str(line.link_path), 4_500_000) as host:
        host.write(b"x")
        assert readable(line.fileno(), 1000)
        line.poll_once()
    assert reported == [4_500_000]
    line.close()


def test_a_device_is_stepped_before_it_is_read(tmp_path: Path) -> None:
    class Watch(Echo):
        def __init__(self) -> None:
            super().__init__()
            self.told_ns: list[int] = []

        def step(self, now_ns: int) -> None:
            self.told_ns.append(now_ns)

    device = Watch()
    line = PtyLine(device, tmp_path / "servos", now_ns=lambda: 77)
    line.poll_once()
    assert device.told_ns == [77]
    line.close()


def test_bytes_are_sent_at_the_moment_they_are_due_and_not_before(
    line: PtyLine, host: int, device: Echo
) -> None:
    device.ready = b"reply"
    early = []

    def now_ns() -> int:
        early.append(readable(host, 0))
        return len(early)

    line.send_at(5, now_ns)
    assert early == [False] * 5
    assert readable(host, 1000)
    assert os.read(host, 16) == b"reply"
