"""Servos on a bench whose wire can carry what one bank of emulated servos cannot."""

from collections.abc import Callable, Sequence

import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel.tools.bench import DynamixelBench
from sim_twin.ports.lines import MemoryLine
from sim_twin.servos import EmulatedServoSpec
from sim_twin.servos.server import FreeServos


class Wire:
    """Carry one bus whose servos turn freely; the wire's clock is their time.

    Several banks share it as several servos do: where they answer at once, a low level of any of
    them is what everybody hears.
    """

    def __init__(self, *banks: Sequence[EmulatedServoSpec]) -> None:
        self.banks = [FreeServos(bank) for bank in banks]
        self.extra = b""
        self.requests: list[bytes] = []
        self.one_after_another = False
        self.time_ns = 10 * NS_PER_S
        self.sleep_until(self.time_ns + NS_PER_S // 100)
        # two servos never agree on when they were switched on
        for index, bank in enumerate(self.banks):
            bank.rotors.position_rad += 0.37 * index
        self.sleep_until(self.time_ns + NS_PER_S // 100)

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = max(self.time_ns, deadline_ns)
        for bank in self.banks:
            bank.advance_to(self.time_ns)

    def receive(self, data: bytes) -> None:
        self.requests.append(data)
        for bank in self.banks:
            bank.bank.receive(data)

    def transmit(self) -> bytes:
        replies = [reply for bank in self.banks if (reply := bank.bank.transmit())]
        extra, self.extra = self.extra, b""
        if self.one_after_another:
            return b"".join(replies) + extra
        longest = max(map(len, replies), default=0)
        merged = bytes(255 for _ in range(longest))
        for reply in replies:
            merged = bytes(
                a & b for a, b in zip(merged, reply.ljust(longest, b"\xff"), strict=True)
            )
        return merged + extra

    def step(self, now_ns: int) -> None:
        pass

    def open(self, baud: int = 1_000_000) -> DynamixelBench:
        return DynamixelBench(MemoryLine(self, self), self, baud)


def specs(*ids: int, model: str = "XM430-W350") -> list[EmulatedServoSpec]:
    return [EmulatedServoSpec(id=one, model_name=model) for one in ids]


@pytest.fixture
def make_wire() -> Callable[..., Wire]:
    return Wire


@pytest.fixture
def make_specs() -> Callable[..., list[EmulatedServoSpec]]:
    return specs
