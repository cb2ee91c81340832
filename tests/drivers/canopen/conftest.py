"""Drives with free wheels and their driver, stepped together."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import can
import numpy as np
import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.wheel_drives.bus import DriveState
from sim_twin.can import MemoryBus, MotorMounting, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

TICK_NS = 4_000_000
HEARTBEAT_S = 0.1


class Bench(FreeWheelWorld[WheelDrive]):
    """Hold emulated drives, one for each spec unless `drives` says otherwise, and a driver."""

    def __init__(
        self, *specs: DriveSpec, drives: Sequence[WheelDrive] = (), **options: Any
    ) -> None:
        specs = specs or (DriveSpec(node_id=1, joint="left"),)
        self.drives = list(drives) or [
            WheelDrive(spec.node_id, MotorMounting(sign=spec.sign)) for spec in specs
        ]
        super().__init__([FreeWheel(drive) for drive in self.drives])
        self.memory_bus = MemoryBus(self.wire)
        options = {"heartbeat_s": HEARTBEAT_S} | options
        self.bus = WheelDriveBus(self.memory_bus, self, specs, **options)

    @property
    def velocities(self) -> list[float]:
        return [wheel.velocity_rad_s for wheel in self.wheels]

    def value(self, index: int, subindex: int = 0) -> int:
        """Return an object of the first drive."""
        return self.drives[0]._objects.get(index, subindex)

    def pause(self, duration_s: float) -> None:
        self.sleep_until(self.now_ns() + round(duration_s * 1e9))

    def run(self, duration_s: float, velocity: Sequence[float] | None = None) -> DriveState:
        wanted = None if velocity is None else np.array(velocity)
        state = self.bus.cycle(wanted)
        for _ in range(round(duration_s * 1e9) // TICK_NS):
            self.sleep_until(self.now_ns() + TICK_NS)
            state = self.bus.cycle(wanted)
        return state

    def inject(self, can_id: int, data: bytes) -> None:
        """Send a frame from an unknown node."""
        with MemoryBus(self.wire) as outsider:
            outsider.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))

    def put(self, can_id: int, data: bytes) -> None:
        """Queue a frame for the host to receive."""
        self.memory_bus.port(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))


@pytest.fixture
def make_bench() -> Iterator[Callable[..., Bench]]:
    """Build benches; their drivers are closed at the end."""
    benches: list[Bench] = []

    def make(*specs: DriveSpec, **options: Any) -> Bench:
        benches.append(Bench(*specs, **options))
        return benches[-1]

    yield make
    for bench in benches:
        bench.bus.close()


@pytest.fixture
def single(make_bench: Callable[..., Bench]) -> Bench:
    """One drive, not connected."""
    return make_bench()


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    """Two connected drives, the right one mounted mirrored."""
    bench = make_bench(
        DriveSpec(node_id=1, joint="left"), DriveSpec(node_id=2, joint="right", sign=-1)
    )
    bench.bus.connect()
    return bench


@pytest.fixture
def enabled(bench: Bench) -> Bench:
    bench.bus.enable()
    assert bench.run(0.05).enabled
    return bench
