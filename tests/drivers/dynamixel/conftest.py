from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import BlockLayout, DynamixelBus, ServoSpec
from drivers.dynamixel.wire.codec import Instruction, PacketParser
from drivers.errors import LinkLost
from sim_twin.contracts.scripted import ManualClock
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions, ServoBank
from sim_twin.servos.server import FreeServos

MODELS = ("XM540-W270", "XM430-W350", "XL430-W250", "XC430-W150")


class Recorder:
    """Stand between a line and a bank, note every instruction, and change replies on request."""

    def __init__(self, bank: ServoBank) -> None:
        self.bank = bank
        self.sent: list[tuple[int, int]] = []
        self.edit: Callable[[bytes], bytes] = lambda reply: reply
        self._parser = PacketParser()

    def receive(self, data: bytes) -> None:
        self._parser.feed(data)
        self.sent += [(packet.instruction, packet.servo_id) for packet in self._parser.packets()]
        self.bank.receive(data)

    def transmit(self) -> bytes:
        reply = self.bank.transmit()
        return self.edit(reply) if reply else reply

    def step(self, now_ns: int) -> None:
        self.bank.step(now_ns)

    def count(self, instruction: Instruction) -> int:
        return sum(sent == instruction for sent, _ in self.sent)


class Bench:
    """A bus on emulated, freely turning servos; the bench's clock is the servos' time."""

    def __init__(
        self,
        count: int = 4,
        *,
        specs: Sequence[ServoSpec] | None = None,
        servos: Sequence[EmulatedServoSpec] | None = None,
        options: FirmwareOptions | None = None,
        fast_sync: bool | None = True,
        layout: BlockLayout = BlockLayout.DIRECT,
        health_every_cycles: int = 5,
    ) -> None:
        self.specs = list(specs) if specs is not None else make_specs(count)
        self.servos = FreeServos(
            servos
            if servos is not None
            else [EmulatedServoSpec(id=s.id, model_name=s.model_name) for s in self.specs],
            options or FirmwareOptions(),
        )
        self.bank = self.servos.bank
        self.rotors = self.servos.rotors
        self.time_ns = 10 * NS_PER_S
        self.run(0.01)
        self.wire = Recorder(self.bank)
        self.line = MemoryLine(self.wire, self)
        self.fast_sync = fast_sync
        self.layout = layout
        self.health_every_cycles = health_every_cycles
        self.bus = self.new_bus()

    def new_bus(self) -> DynamixelBus:
        return DynamixelBus(
            self.line,
            self,
            self.specs,
            baud=1_000_000,
            fast_sync=self.fast_sync,
            layout=self.layout,
            health_every_cycles=self.health_every_cycles,
        )

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.run((deadline_ns - self.time_ns) / NS_PER_S)

    def run(self, seconds: float) -> None:
        self.time_ns += round(seconds * NS_PER_S)
        self.servos.advance_to(self.time_ns)

    def cycle(self, count: int = 1) -> None:
        for _ in range(count):
            self.run(0.004)
            self.bus.read_state()


class PacedLine:
    """Carry bytes to emulated servos at the wire's speed; a wait passes in simulated time.

    Bytes are handed over `chunk_bytes` at a time; a UART that collects a whole reply has a big one.
    """

    def __init__(
        self,
        clock: ManualClock,
        servos: Sequence[EmulatedServoSpec],
        *,
        baud: int = 1_000_000,
        bauds: tuple[int, ...] = (),
        chunk_bytes: int = 14,
    ) -> None:
        self.servos = FreeServos(servos)
        self.bank = self.servos.bank
        self.bauds = bauds or (baud,)
        self.adapter = ""
        self.unplugged = False
        self._clock = clock
        self._byte_ns = 10 * NS_PER_S // baud
        self._chunk_bytes = chunk_bytes
        self._pending = bytearray()
        self._first_ns = 0
        self.servos.advance_to(clock.ns)

    def write(self, data: bytes) -> None:
        self._check()
        now_ns = max(self._clock.ns, self._first_ns + len(self._pending) * self._byte_ns)
        self.servos.advance_to(self._clock.ns)
        self.bank.receive(data)
        answer = self.bank.transmit()
        if not self._pending:
            own_bytes = 0 if answer.startswith(data) else len(data)
            self._first_ns = now_ns + own_bytes * self._byte_ns
        self._pending += answer

    def read(self, max_bytes: int, deadline_ns: int) -> bytes:
        self._check()
        count = min(len(self._pending), self._chunk_bytes, max_bytes)
        due_ns = self._first_ns + count * self._byte_ns
        if not count or due_ns > max(deadline_ns, self._clock.ns):
            self._clock.sleep_until(deadline_ns)
            return b""
        self._clock.sleep_until(due_ns)
        arrived = (self._clock.ns - self._first_ns) // self._byte_ns
        count = min(len(self._pending), arrived, max_bytes)
        self._first_ns += count * self._byte_ns
        data = bytes(self._pending[:count])
        del self._pending[:count]
        return data

    def set_baud(self, baud: int) -> None:
        self._pending.clear()
        self.bank.set_host_baud(baud)

    def adapter_fault(self) -> str:
        return self.adapter

    def discard_input(self) -> None:
        self._pending.clear()

    def close(self) -> None:
        self._pending.clear()

    def _check(self) -> None:
        if self.unplugged:
            raise LinkLost("test line: unplugged; plug it in again")


class SleepingLine(PacedLine):
    """Read only when all bytes are due, as a serial port does."""

    def read_burst(self, count: int, due_ns: int, deadline_ns: int) -> bytes:
        self._clock.sleep_until(due_ns)
        data = b""
        while len(data) < count:
            more = self.read(count - len(data), deadline_ns)
            if not more:
                break
            data += more
        return data


class PacedBench:
    """A bus of one model at the speed of the wire."""

    def __init__(
        self,
        count: int = 16,
        *,
        clock: ManualClock | None = None,
        eeprom: Mapping[str, int] | None = None,
        bauds: tuple[int, ...] = (),
        chunk_bytes: int = 14,
        sleeping: bool = False,
        **options: Any,
    ) -> None:
        self.clock = clock or ManualClock(10 * NS_PER_S)
        self.specs = [
            ServoSpec(id=n, model_name="XM430-W350", joint=f"joint_{n}")
            for n in range(1, count + 1)
        ]
        settings = {"return_delay_time": 0, **(eeprom or {})}
        emulated = [
            EmulatedServoSpec(id=spec.id, model_name=spec.model_name, eeprom=settings)
            for spec in self.specs
        ]
        line = SleepingLine if sleeping else PacedLine
        self.line = line(self.clock, emulated, bauds=bauds, chunk_bytes=chunk_bytes)
        self.bank = self.line.bank
        options = {"health_every_cycles": 1000, "layout": BlockLayout.DIRECT} | options
        self.bus = DynamixelBus(self.line, self.clock, self.specs, baud=1_000_000, **options)

    def timed_read_ns(self) -> int:
        start_ns = self.clock.ns
        self.bus.read_state()
        return self.clock.ns - start_ns


def make_specs(count: int) -> list[ServoSpec]:
    return [
        ServoSpec(
            id=index + 1,
            model_name=MODELS[index % len(MODELS)],
            joint=f"joint_{index + 1}",
            sign=-1 if index % 2 else 1,
            offset_rad=0.1 * index,
        )
        for index in range(count)
    ]


@pytest.fixture
def make_bench() -> Callable[..., Bench]:
    return Bench


@pytest.fixture
def make_paced() -> Callable[..., PacedBench]:
    return PacedBench


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.bus.connect()
    return bench
