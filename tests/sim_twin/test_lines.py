import pytest

from drivers.base import ByteTransport
from drivers.errors import LinkLost
from sim_twin.lines import MemoryLine

LATER_NS = 10**12


class FakeClock:
    def __init__(self) -> None:
        self.time_ns = 0

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = deadline_ns


class Shouter:
    """A device that answers everything in capitals, and speaks on its own when stepped."""

    def __init__(self) -> None:
        self.ready = b""

    def receive(self, data: bytes) -> None:
        self.ready += data.upper()

    def transmit(self) -> bytes:
        ready, self.ready = self.ready, b""
        return ready

    def step(self, now_ns: int) -> None:
        self.ready += b"tick"


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


@pytest.fixture
def device() -> Shouter:
    return Shouter()


@pytest.fixture
def line(device: Shouter, clock: FakeClock) -> MemoryLine:
    return MemoryLine(device, clock)


def test_it_is_a_transport_and_a_reply_is_there_at_once(line: MemoryLine) -> None:
    transport: ByteTransport = line
    transport.write(b"hello")
    assert transport.read(64, LATER_NS) == b"HELLO"


def test_a_silent_device_gives_nothing_at_once_and_time_stands_still(
    line: MemoryLine, clock: FakeClock
) -> None:
    assert line.read(64, LATER_NS) == b""
    assert clock.now_ns() == 0


def test_what_is_not_read_stays_for_the_next_read(line: MemoryLine) -> None:
    line.write(b"abcdef")
    assert line.read(4, LATER_NS) == b"ABCD"
    line.write(b"g")
    assert line.read(4, LATER_NS) == b"EFG"


def test_a_device_that_streams_is_heard_without_a_question(
    line: MemoryLine, device: Shouter
) -> None:
    device.step(1)
    assert line.read(64, 0) == b"tick"


def test_discarding_drops_bytes_on_both_sides_of_the_line(line: MemoryLine) -> None:
    line.write(b"abcdef")
    assert line.read(2, LATER_NS) == b"AB"
    line.write(b"g")
    line.discard_input()
    assert line.read(64, LATER_NS) == b""


def test_an_unplugged_line_says_since_when(line: MemoryLine, clock: FakeClock) -> None:
    clock.time_ns = 12_345_000_000
    line.unplug()
    with pytest.raises(LinkLost, match=r"Shouter: unplugged at 12\.345 s"):
        line.write(b"a")
    with pytest.raises(LinkLost):
        line.read(1, LATER_NS)


def test_a_replugged_line_carries_only_new_bytes(line: MemoryLine, device: Shouter) -> None:
    line.write(b"old")
    line.unplug()
    device.step(1)
    line.replug()
    assert line.read(64, LATER_NS) == b""
    line.write(b"new")
    assert line.read(64, LATER_NS) == b"NEW"


def test_closing_twice_is_allowed(line: MemoryLine) -> None:
    line.close()
    line.close()
