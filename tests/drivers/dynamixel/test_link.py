"""Every wait is bounded by the wire time plus the margin, even on a babbling or silent line."""

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import BlockLayout, DynamixelBus, ServoSpec
from drivers.dynamixel.wire.codec import Instruction
from drivers.dynamixel.wire.link import PacketLink
from drivers.servo.counters import BusCounters
from drivers.servo.errors import ServoSilent
from drivers.servo.patience import ReplyPatience
from sim_twin.contracts.scripted import ManualClock
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions
from sim_twin.servos.server import FreeServos

BYTE_NS = 10_000  # at 1 Mbps
SPECS = [ServoSpec(id=n, model_name="XM430-W350", joint=f"joint_{n}") for n in range(1, 17)]


class SilentLine:
    """Wait until the deadline, as a real port does, and bring nothing."""

    def __init__(self, clock: ManualClock) -> None:
        self._clock = clock
        self.written = 0

    def write(self, data: bytes) -> None:
        self.written += len(data)

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        self._clock.sleep_until(deadline_ns)
        return b""

    def discard_input(self) -> None: ...

    def close(self) -> None: ...


class BabblingLine(SilentLine):
    """Send meaningless bytes without end; each read takes their time on the wire."""

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        if self._clock.ns >= deadline_ns:
            return b""
        self._clock.ns += 20 * BYTE_NS
        return b"\x00" * min(20, max_bytes)


class SwitchedLine:
    """Answer as sixteen emulated servos do, until the line goes bad."""

    def __init__(self, clock: ManualClock, bad: SilentLine) -> None:
        servos = FreeServos(
            [EmulatedServoSpec(id=s.id, model_name=s.model_name) for s in SPECS], FirmwareOptions()
        )
        servos.advance_to(clock.ns)
        self._good = MemoryLine(servos.bank, clock)
        self._bad = bad
        self.answering = True

    def write(self, data: bytes) -> None:
        if self.answering:
            self._good.write(data)

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        line = self._good if self.answering else self._bad
        return line.read(max_bytes, deadline_ns)

    def discard_input(self) -> None: ...

    def close(self) -> None: ...


class FloodedLine(SilentLine):
    """Return bytes without end at once."""

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        self._clock.ns += BYTE_NS
        return b"\x55" * max_bytes


@pytest.mark.parametrize("fast_sync", [True, False])
@pytest.mark.parametrize("line_type", [SilentLine, BabblingLine])
def test_a_cycle_without_answers_costs_the_wire_time_and_two_milliseconds(
    line_type: type[SilentLine], fast_sync: bool
) -> None:
    clock = ManualClock(5 * NS_PER_S)
    line = SwitchedLine(clock, line_type(clock))
    bus = DynamixelBus(
        line, clock, SPECS, baud=1_000_000, fast_sync=fast_sync, layout=BlockLayout.DIRECT
    )
    bus.connect()
    line.answering = False
    start_ns = clock.ns
    bus.read_state()
    wire_ns = (30 + (232 if fast_sync else 336)) * BYTE_NS
    assert clock.ns - start_ns <= wire_ns + 2_000_000 + 20 * BYTE_NS
    assert not bus.state.valid.any()
    assert bus.counters.timeouts >= 16  # in a fast sync read some are asked twice


def test_bytes_without_end_do_not_hold_the_bus() -> None:
    clock = ManualClock(5 * NS_PER_S)
    link = PacketLink(FloodedLine(clock), clock, 1_000_000, BusCounters())
    link.send(b"request")
    assert link.counters.late == 16
    assert clock.ns - 5 * NS_PER_S < NS_PER_S


def test_a_request_is_repeated_as_often_as_asked() -> None:
    clock = ManualClock(5 * NS_PER_S)
    line = SilentLine(clock)
    link = PacketLink(line, clock, 1_000_000, BusCounters())
    with pytest.raises(ServoSilent, match="ping servo 1: no answer in 4 attempts"):
        link.request(
            1,
            Instruction.PING,
            b"",
            answer_bytes=3,
            patience=ReplyPatience(margin_s=0.001, attempts=4),
            name="ping servo 1",
        )
    assert line.written == 40
    assert (link.counters.timeouts, link.counters.retries) == (4, 3)
