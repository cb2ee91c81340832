import pytest

from drivers.base import ByteTransport
from drivers.errors import LinkLost
from sim_twin.contracts.scripted import ManualClock
from sim_twin.ports.lines import MemoryLine

LATER_NS = 10**12


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
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def device() -> Shouter:
    return Shouter()


@pytest.fixture
def line(device: Shouter, clock: ManualClock) -> MemoryLine:
    return MemoryLine(device, clock)


def test_it_is_a_transport_and_a_reply_is_there_at_once(line: MemoryLine) -> None:
    transport: ByteTransport = line
    transport.write(b"hello")
    assert transport.read(64, LATER_NS) == b"HELLO"


def test_a_silent_device_gives_nothing_at_once_and_time_stands_still(
    line: MemoryLine, clock: ManualClock
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


def test_an_unplugged_line_says_since_when(line: MemoryLine, clock: ManualClock) -> None:
    clock.ns = 12_345_000_000
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


class Postman(Shouter):
    """A device whose answer is under way for a while."""

    def __init__(self, travel_ns: int, *, paced: bool) -> None:
        super().__init__()
        self.paced = paced
        self.time_ns = 0
        self._travel_ns = travel_ns
        self._due_ns: int | None = None

    def receive(self, data: bytes) -> None:
        super().receive(data)
        self._due_ns = self.time_ns + self._travel_ns

    def transmit(self) -> bytes:
        if self._due_ns is None or self.time_ns < self._due_ns:
            return b""
        self._due_ns = None
        return super().transmit()

    def step(self, now_ns: int) -> None:
        self.time_ns = now_ns

    def next_due_ns(self) -> int | None:
        return self._due_ns


@pytest.mark.parametrize("paced", [False, True])
def test_a_read_moves_time_to_the_arrival_of_what_is_under_way(
    clock: ManualClock, paced: bool
) -> None:
    line = MemoryLine(Postman(300, paced=paced), clock)
    line.write(b"hello")
    assert line.read(64, 400) == b"HELLO"
    assert clock.now_ns() == 300


@pytest.mark.parametrize(("paced", "waited_ns"), [(False, 0), (True, 200)])
def test_a_read_that_ends_too_early_waits_to_its_deadline_on_a_paced_line_only(
    clock: ManualClock, paced: bool, waited_ns: int
) -> None:
    line = MemoryLine(Postman(300, paced=paced), clock)
    line.write(b"hello")
    assert line.read(64, 200) == b""
    assert clock.now_ns() == waited_ns
    assert line.read(64, 300) == b"HELLO"
    assert clock.now_ns() == 300
