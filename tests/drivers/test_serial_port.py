"""A tty is opened, locked, read without spinning, and its loss is reported at once."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from drivers.errors import DeviceBusy, DeviceMissing, LinkLost
from drivers.serial_port import SerialPort

CLOCK = MonotonicClock()


@pytest.fixture
def pty(tmp_path: Path) -> Iterator[tuple[int, Path]]:
    master, slave = os.openpty()
    link = tmp_path / "servos"
    link.symlink_to(os.ttyname(slave))
    os.close(slave)
    yield master, link
    try:
        os.close(master)
    except OSError as error:
        assert "descriptor" in str(error)  # the test closed it to unplug


@pytest.fixture
def port(pty: tuple[int, Path]) -> Iterator[SerialPort]:
    port = SerialPort(pty[1], 1_000_000, CLOCK)
    yield port
    port.close()


@pytest.fixture
def master(pty: tuple[int, Path]) -> int:
    return pty[0]


def soon(seconds: float) -> int:
    return CLOCK.now_ns() + round(seconds * 1e9)


def test_bytes_pass_unchanged_both_ways_through_a_symlink(master: int, port: SerialPort) -> None:
    every_byte = bytes(range(256))
    port.write(every_byte)
    assert os.read(master, 512) == every_byte
    os.write(master, every_byte)
    received = b""
    while len(received) < 256:
        chunk = port.read(256, soon(1.0))
        assert chunk
        received += chunk
    assert received == every_byte


def test_a_silent_line_returns_nothing_at_the_deadline_without_spinning(port: SerialPort) -> None:
    cpu = time.process_time()
    start = CLOCK.now_ns()
    assert port.read(10, soon(0.1)) == b""
    waited_s = (CLOCK.now_ns() - start) / 1e9
    assert waited_s >= 0.1
    assert time.process_time() - cpu < 0.03
    assert port.read(10, 0) == b""


def test_a_read_returns_what_is_there_up_to_the_limit(master: int, port: SerialPort) -> None:
    os.write(master, b"abcdef")
    assert port.read(4, soon(1.0)) == b"abcd"
    assert port.read(4, soon(1.0)) == b"ef"


def test_discarded_input_is_gone(master: int, port: SerialPort) -> None:
    os.write(master, b"stale")
    assert port.read(1, soon(1.0)) == b"s"
    port.discard_input()
    assert port.read(10, soon(0.01)) == b""


def test_a_second_opener_finds_the_port_busy(pty: tuple[int, Path]) -> None:
    _, path = pty
    port = SerialPort(path, 57_600, CLOCK)
    with pytest.raises(DeviceBusy, match="stop the process that holds it"):
        SerialPort(path, 57_600, CLOCK)
    port.close()
    port.close()
    SerialPort(path, 57_600, CLOCK).close()


def test_a_path_that_is_not_there_or_no_tty_is_named_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match=r"ttyNONE.*plug the adapter in"):
        SerialPort(tmp_path / "ttyNONE", 57_600, CLOCK)
    (tmp_path / "file").write_text("")
    with pytest.raises(DeviceMissing, match="not a serial port"):
        SerialPort(tmp_path / "file", 57_600, CLOCK)


def test_an_unknown_baud_rate_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="baud must be one of"):
        SerialPort(tmp_path / "any", 12_345, CLOCK)


def test_every_operation_on_an_unplugged_port_fails_at_once(master: int, port: SerialPort) -> None:
    os.close(master)
    start = CLOCK.now_ns()
    with pytest.raises(LinkLost, match="reconnect"):
        port.read(10, soon(5.0))
    with pytest.raises(LinkLost, match="reconnect"):
        port.write(b"x")
    assert CLOCK.now_ns() - start < 1_000_000_000


def test_a_line_that_takes_no_bytes_is_given_up_instead_of_blocking(port: SerialPort) -> None:
    start = CLOCK.now_ns()
    with pytest.raises(LinkLost, match="took no byte"):
        port.write(bytes(1_000_000))
    assert CLOCK.now_ns() - start < 1_000_000_000


@pytest.mark.parametrize(("latency", "fault"), [("1", ""), ("16", "got 16 ms")])
def test_an_adapter_that_holds_back_bytes_is_reported_with_the_remedy(
    pty: tuple[int, Path], tmp_path: Path, latency: str, fault: str
) -> None:
    _, path = pty
    device = tmp_path / "sys/bus/usb-serial/devices" / path.resolve().name
    device.mkdir(parents=True)
    (device / "latency_timer").write_text(latency + "\n")
    port = SerialPort(path, 1_000_000, CLOCK, sysfs_root=tmp_path / "sys")
    text = port.adapter_fault()
    port.close()
    assert fault in text
    assert bool(text) == bool(fault)
    assert not fault or f"sudo tee {device / 'latency_timer'}" in text


def test_a_port_that_is_no_usb_adapter_has_no_latency_timer(port: SerialPort) -> None:
    assert port.adapter_fault() == ""


def test_a_burst_is_the_bytes_asked_for_or_what_came_of_them(master: int, port: SerialPort) -> None:
    os.write(master, b"0123456789")
    assert port.read_burst(4, 0, soon(1.0)) == b"0123"
    assert port.read_burst(10, 0, soon(0.05)) == b"456789"
    assert port.read_burst(10, 0, soon(0.0)) == b""


class NapClock:
    """Stand still until `idle`; a sleep lets the other end send meanwhile."""

    def __init__(self, master: int) -> None:
        self.naps_until_ns: list[int] = []
        self.sent_meanwhile: list[bytes] = []
        self._master = master
        self._now_ns = NS_PER_S

    def now_ns(self) -> int:
        return self._now_ns

    def idle(self, duration_ns: int) -> None:
        self._now_ns += duration_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.naps_until_ns.append(deadline_ns)
        os.write(self._master, self.sent_meanwhile.pop(0))


def test_a_line_whose_bytes_take_their_time_is_slept_through_until_the_last_is_due(
    pty: tuple[int, Path],
) -> None:
    master, path = pty
    clock = NapClock(master)
    port = SerialPort(path, 1_000_000, clock)
    due_ns, deadline_ns = NS_PER_S + 3_000_000, 3 * NS_PER_S
    os.write(master, b"0123")
    assert port.read_burst(4, due_ns, deadline_ns) == b"0123"
    assert clock.naps_until_ns == []
    clock.sent_meanwhile = [b"89", b"abcd"]
    os.write(master, b"4567")
    assert port.read_burst(6, due_ns, deadline_ns) == b"456789"
    assert port.read_burst(4, due_ns, deadline_ns) == b"abcd"
    assert len(clock.naps_until_ns) == 2
    assert all(due_ns - 1_000_000 < nap_ns <= due_ns for nap_ns in clock.naps_until_ns)
    port.close()


def test_a_port_at_leisure_learns_to_sleep_until_all_bytes_are_there(
    pty: tuple[int, Path],
) -> None:
    master, path = pty
    clock = NapClock(master)
    port = SerialPort(path, 1_000_000, clock)
    os.write(master, b"0")
    clock.sent_meanwhile = [b"123"]
    assert port.read_burst(4, clock.now_ns() + 3_000_000, 3 * NS_PER_S) == b"0123"
    late_ns = []
    for meanwhile in (b"01", b"01", b"0123", b"0123"):
        clock.idle(10_000_000)
        due_ns = clock.now_ns() + 3_000_000
        clock.sent_meanwhile = [meanwhile]
        assert port.read_burst(4, due_ns, due_ns + 5_000_000) == meanwhile
        late_ns.append(clock.naps_until_ns[-1] - due_ns)
    assert late_ns[0] < late_ns[1] < late_ns[2]
    assert late_ns[3] < late_ns[2]
    assert all(0 <= late < 1_000_000 for late in late_ns)
    port.close()


def test_a_burst_that_is_overdue_is_not_slept_for(pty: tuple[int, Path]) -> None:
    master, path = pty
    clock = NapClock(master)
    port = SerialPort(path, 1_000_000, clock)
    os.write(master, b"01")
    assert port.read_burst(4, NS_PER_S, NS_PER_S + 50_000_000) == b"01"
    assert clock.naps_until_ns == []
    port.close()


def test_the_speed_can_be_changed_to_one_on_offer(port: SerialPort) -> None:
    port.set_baud(57_600)
    with pytest.raises(ValueError, match="baud must be one of"):
        port.set_baud(12_345)
    assert 57_600 in port.bauds
