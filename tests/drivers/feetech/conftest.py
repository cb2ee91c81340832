from collections.abc import Callable, Mapping, Sequence

import pytest

from drivers.clock import NS_PER_S
from drivers.feetech.bus import FeetechBus
from drivers.feetech.codec import FeetechInstruction, FeetechPacket, FeetechParser
from drivers.feetech.servo import FeetechServo
from drivers.feetech.tools.bench import FeetechBench
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos.feetech.spec import EmulatedFeetechSpec
from sim_twin.servos.server import FreeFeetechServos

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


class Bench:
    """An arm's servos that turn freely; the bench's clock is their time."""

    def __init__(
        self,
        count: int = 6,
        *,
        model: str = "STS3215-C018",
        eeprom: Mapping[int, Mapping[str, int]] | None = None,
        supply_v: float = 12.0,
        servos: Sequence[FeetechServo] | None = None,
        health_every_cycles: int = 5,
    ) -> None:
        self.specs = list(servos) if servos is not None else make_servos(count, model)
        emulated = [
            EmulatedFeetechSpec(id=one.id, model_name=model, eeprom=(eeprom or {}).get(one.id, {}))
            for one in self.specs
        ]
        self.servos = FreeFeetechServos(emulated)
        self.servos.supply_v = supply_v
        self.bank = self.servos.bank
        self.rotors = self.servos.rotors
        self.sent: list[FeetechPacket] = []
        self.edit: Callable[[bytes], bytes] = lambda reply: reply
        self._parser = FeetechParser()
        self.time_ns = 10 * NS_PER_S
        self.run(0.05)
        self.line = MemoryLine(self, self)
        self.health_every_cycles = health_every_cycles
        self.bus = self.new_bus()

    def new_bus(self) -> FeetechBus:
        return FeetechBus(
            self.line,
            self,
            self.specs,
            baud=1_000_000,
            health_every_cycles=self.health_every_cycles,
        )

    def open(self) -> FeetechBench:
        return FeetechBench(self.line, self, 1_000_000)

    # the wire's other end

    def receive(self, data: bytes) -> None:
        self.sent += self._parser.feed(data)
        self.bank.receive(data)

    def transmit(self) -> bytes:
        reply = self.bank.transmit()
        return self.edit(reply) if reply else reply

    def step(self, now_ns: int) -> None:
        self.bank.step(now_ns)

    # the clock

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.run(max(0, deadline_ns - self.time_ns) / NS_PER_S)

    def run(self, seconds: float) -> None:
        self.time_ns += round(seconds * NS_PER_S)
        self.servos.advance_to(self.time_ns)

    def cycle(self, count: int = 1) -> None:
        for _ in range(count):
            self.run(0.004)
            self.bus.read_state()

    def count(self, instruction: FeetechInstruction) -> int:
        return sum(packet.code == instruction for packet in self.sent)


def make_servos(count: int, model: str) -> list[FeetechServo]:
    return [
        FeetechServo(
            id=row + 1,
            model_name=model,
            joint=JOINTS[row],
            sign=-1 if row % 2 else 1,
            offset_rad=0.1 * row,
        )
        for row in range(count)
    ]


@pytest.fixture
def make_bench() -> Callable[..., Bench]:
    return Bench


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.bus.connect()
    bench.cycle()
    return bench
