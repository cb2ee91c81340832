from collections.abc import Callable, Sequence

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.dynamixel.codec import Instruction, PacketParser
from sim_twin.lines import MemoryLine
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
        fast_sync: bool = True,
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
        self.health_every_cycles = health_every_cycles
        self.bus = self.new_bus()

    def new_bus(self) -> DynamixelBus:
        return DynamixelBus(
            self.line,
            self,
            self.specs,
            baud=1_000_000,
            fast_sync=self.fast_sync,
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
def bench() -> Bench:
    bench = Bench()
    bench.bus.connect()
    return bench
