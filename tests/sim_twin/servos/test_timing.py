"""On a paced bus every byte takes its time; the time is simulated, so it is exact."""

import struct
from collections.abc import Callable

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import BAUD_RATES
from drivers.dynamixel.wire.codec import BROADCAST_ID, Instruction, encode_instruction
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos.protocol.timing import FIFO_BYTES, WireTiming
from sim_twin.servos.server import FreeServos, make_specs

COUNT = 16
BLOCK = struct.pack("<HH", 126, 10) + bytes(range(1, COUNT + 1))
READ = encode_instruction(BROADCAST_ID, Instruction.SYNC_READ, BLOCK)
FAST_READ = encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, BLOCK)
PING = encode_instruction(1, Instruction.PING)
REPLY_BYTES = {READ: COUNT * 21, FAST_READ: 8 + COUNT * 14, PING: 14}
PATIENCE_NS = NS_PER_S
US = 1000
BAUD_VALUES = {rate: value for value, rate in BAUD_RATES.items()}


class PacedBus:
    """Servos behind a line, and a clock that moves them."""

    def __init__(self, timing: WireTiming | None, *, return_delay: int = 0) -> None:
        baud = timing.baud if timing else 57_600
        eeprom = {"return_delay_time": return_delay, "baud_rate": BAUD_VALUES[baud]}
        self.servos = FreeServos(make_specs(COUNT, ["XM430-W350"], eeprom), timing=timing)
        self.bank = self.servos.bank
        self.time_ns = NS_PER_S
        self.servos.advance_to(self.time_ns)
        self.line = MemoryLine(self.bank, self)

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)
        self.servos.advance_to(self.time_ns)

    def ask(self, request: bytes, patience_ns: int = PATIENCE_NS) -> tuple[bytes, list[int]]:
        """Return what is answered, and how long after the request each piece was there."""
        start_ns, received, times_ns = self.time_ns, b"", []
        self.line.write(request)
        while len(received) < REPLY_BYTES.get(request, 1):
            data = self.line.read(4096, start_ns + patience_ns)
            if not data:
                break
            received += data
            times_ns.append(self.time_ns - start_ns)
        return received, times_ns


def wire_ns(count: int, baud: int) -> float:
    return count * 10 * NS_PER_S / baud


@pytest.mark.parametrize("baud", [57_600, 1_000_000, 3_000_000, 4_000_000])
@pytest.mark.parametrize("request_", [READ, FAST_READ], ids=["sync read", "fast sync read"])
def test_a_transaction_takes_its_bytes_at_the_baud_rate(baud: int, request_: bytes) -> None:
    bus = PacedBus(WireTiming(baud=baud))
    for _ in range(3):
        reply, times_ns = bus.ask(request_)
        assert len(reply) == REPLY_BYTES[request_]
        expected_ns = wire_ns(len(request_) + len(reply), baud)
        assert times_ns[-1] == pytest.approx(expected_ns, abs=COUNT)


def test_each_reply_arrives_with_its_last_byte(baud: int = 1_000_000) -> None:
    _, times_ns = PacedBus(WireTiming(baud=baud)).ask(READ)
    assert times_ns == [round(wire_ns(30 + 21 * count, baud)) for count in range(1, COUNT + 1)]


def test_a_long_reply_arrives_in_pieces() -> None:
    reply, times_ns = PacedBus(WireTiming(baud=1_000_000)).ask(FAST_READ)
    arrived = [*range(FIFO_BYTES, len(reply), FIFO_BYTES), len(reply)]
    assert times_ns == [(300 + 10 * count) * US for count in arrived]


def test_the_return_delay_register_delays_every_reply_and_a_fast_read_once() -> None:
    bus = PacedBus(WireTiming(baud=1_000_000), return_delay=250)
    assert bus.ask(READ)[1][-1] == (3_660 + COUNT * 500) * US
    assert bus.ask(FAST_READ)[1][-1] == (2_620 + 500) * US
    delay = encode_instruction(1, Instruction.WRITE, struct.pack("<HB", 9, 100))
    assert bus.ask(delay)[1] == [(len(delay) * 10 + 500 + 110) * US]
    assert bus.ask(PING)[1] == [(100 + 200 + 140) * US]


def test_a_write_before_the_read_occupies_the_wire(baud: int = 1_000_000) -> None:
    bus = PacedBus(WireTiming(baud=baud))
    goals = b"".join(struct.pack("<Bi", n + 1, 2048) for n in range(COUNT))
    write = encode_instruction(BROADCAST_ID, Instruction.SYNC_WRITE, b"\x74\0\x04\0" + goals)
    bus.line.write(write)
    assert bus.ask(FAST_READ)[1][-1] == 3_560 * US


def test_a_read_of_a_missing_servo_waits_until_the_deadline() -> None:
    bus = PacedBus(WireTiming(baud=1_000_000))
    bus.bank.silence(3)
    start_ns = bus.time_ns
    reply, _ = bus.ask(READ, 5_000 * US)
    assert len(reply) == (COUNT - 1) * 21
    assert bus.time_ns - start_ns == 5_000 * US


def test_without_timing_replies_are_there_at_once_and_time_stands_still() -> None:
    bus = PacedBus(None)
    assert bus.ask(READ)[1] == [0]
    bus.bank.silence(1)
    assert bus.ask(PING) == (b"", [])
    assert bus.time_ns == NS_PER_S


def test_a_late_reply_makes_the_host_wait_for_it_also_without_timing() -> None:
    bus = PacedBus(None)
    bus.bank.delay(1, 0.003)
    assert bus.ask(PING, 2_000 * US) == (b"", [])
    bus.sleep_until(bus.time_ns + 3_000 * US)
    assert len(bus.line.read(64, 0)) == 14
    assert bus.ask(PING, 4_000 * US)[1] == [3_000 * US]


def test_the_latency_timer_holds_bytes_back_until_it_runs_out_or_the_buffer_is_full() -> None:
    bus = PacedBus(WireTiming(baud=1_000_000, latency_timer_s=0.016))
    bus.sleep_until(1_600_000_000 + 1_000 * US)  # 1 ms behind a tick of the timer
    assert bus.ask(PING)[1] == [15_000 * US]
    reply, times_ns = bus.ask(READ)
    full_ns = [round(wire_ns(30 + 62 * count, 1_000_000)) for count in range(1, 6)]
    assert len(reply) == 336
    assert times_ns == [*full_ns, full_ns[-1] + 16_000 * US]


@pytest.mark.parametrize("latency_s", [0.001, 0.004, 0.016])
def test_no_byte_is_lost_or_held_for_longer_than_the_timer(latency_s: float) -> None:
    plain, held = (
        PacedBus(WireTiming(baud=1_000_000, latency_timer_s=timer)) for timer in (0.0, latency_s)
    )
    for _ in range(20):
        reply, times_ns = held.ask(READ)
        expected, plain_ns = plain.ask(READ)
        assert reply == expected
        assert plain_ns[-1] <= times_ns[-1] <= plain_ns[-1] + latency_s * NS_PER_S
        for bus in (plain, held):
            bus.sleep_until(max(plain.time_ns, held.time_ns) + 1_234_567)


def test_jitter_comes_from_the_seed() -> None:
    def times(seed: int) -> list[int]:
        bus = PacedBus(WireTiming(baud=1_000_000, jitter_s=200e-6, seed=seed))
        return [bus.ask(PING)[1][0] for _ in range(50)]

    assert times(1) == times(1) != times(2)
    extra_ns = [time_ns - 240 * US for time_ns in times(1)]
    assert 0 <= min(extra_ns) < 50 * US < 150 * US < max(extra_ns) <= 200 * US


def test_a_host_at_another_speed_paces_the_bus_too() -> None:
    bus = PacedBus(WireTiming(baud=1_000_000))
    to_2_mbps = encode_instruction(1, Instruction.WRITE, struct.pack("<HB", 8, 4))
    bus.bank.set_host_baud(1_000_000)
    assert bus.ask(to_2_mbps)[0]
    assert bus.ask(PING, 5_000 * US) == (b"", [])
    bus.bank.set_host_baud(2_000_000)
    assert bus.ask(PING)[1] == [120 * US]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: WireTiming(baud=0), "baud: expected a positive number, got 0"),
        (lambda: WireTiming(baud=9600, jitter_s=-1.0), "jitter_s: expected >= 0, got -1.0"),
        (lambda: WireTiming(baud=9600, latency_timer_s=-1.0), "latency_timer_s: expected >= 0"),
    ],
)
def test_timing_out_of_range_is_refused(wrong: Callable[[], WireTiming], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        wrong()
