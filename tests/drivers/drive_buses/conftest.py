"""Build two small worlds in lock-step: CiA 402 drives and ODrive axes, each with free wheels."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.odrive import EMULATED_ENDPOINTS, AxisSpec, ODriveBus
from drivers.odrive.codec import AxisError
from drivers.wheel_drives.bus import DriveBus, DriveState
from sim_twin.can import MemoryBus, MotorMounting, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld
from sim_twin.can.odrive.axis import ODriveAxis

TICK_NS = 4_000_000
HEARTBEAT_S = 0.1


class Bench:
    """Hold a world and its driver, whichever protocol they speak."""

    over_temperature: int
    short_circuit: int
    world: FreeWheelWorld[Any]
    bus: DriveBus

    def run(self, duration_s: float, velocity: tuple[float, float] | None = None) -> DriveState:
        wanted = None if velocity is None else np.array(velocity)
        state = self.bus.cycle(wanted)
        for _ in range(round(duration_s * 1e9) // TICK_NS):
            self.pause(TICK_NS / 1e9)
            state = self.bus.cycle(wanted)
        return state

    def pause(self, duration_s: float) -> None:
        self.world.sleep_until(self.world.now_ns() + round(duration_s * 1e9))

    def cut_plug(self) -> None:
        self.world.wire.cut = True

    def speeds(self) -> list[float]:
        return [wheel.velocity_rad_s for wheel in self.world.wheels]

    def powered(self) -> list[bool]:
        return [wheel.drive.armed for wheel in self.world.wheels]

    def kill(self, row: int) -> None:
        self.world.wheels[row].drive.set_supply(on=False)

    def fail(self, row: int) -> None:
        self.world.wheels[row].drive.raise_fault(self.over_temperature)

    def break_down(self, row: int) -> None:
        self.world.wheels[row].drive.raise_fault(self.short_circuit)


class Cia402Bench(Bench):
    """Hold two CiA 402 drives."""

    over_temperature = 0x4310
    short_circuit = 0x2340

    def __init__(self) -> None:
        self.world = FreeWheelWorld(
            [FreeWheel(WheelDrive(1)), FreeWheel(WheelDrive(2, MotorMounting(sign=-1)))]
        )
        self.bus = self.on(self.world)

    @staticmethod
    def on(world: FreeWheelWorld[Any]) -> DriveBus:
        specs = [DriveSpec(node_id=1, joint="left"), DriveSpec(node_id=2, joint="right", sign=-1)]
        return WheelDriveBus(MemoryBus(world.wire), world, specs, HEARTBEAT_S)


class ODriveBench(Bench):
    """Hold two ODrive axes."""

    over_temperature = int(AxisError.MOTOR_OVER_TEMP)
    short_circuit = int(AxisError.DRV_FAULT)

    def __init__(self) -> None:
        self.axes = [ODriveAxis(0), ODriveAxis(1, MotorMounting(sign=-1))]
        self.world = FreeWheelWorld([FreeWheel(axis) for axis in self.axes])
        self.bus = self.on(self.world)

    @staticmethod
    def on(world: FreeWheelWorld[Any]) -> DriveBus:
        specs = [AxisSpec(node_id=0, joint="left"), AxisSpec(node_id=1, joint="right", sign=-1)]
        return ODriveBus(MemoryBus(world.wire), world, specs, EMULATED_ENDPOINTS, HEARTBEAT_S)


@pytest.fixture
def cia402() -> Iterator[Cia402Bench]:
    bench = Cia402Bench()
    yield bench
    bench.bus.close()


@pytest.fixture
def odrive() -> Iterator[ODriveBench]:
    bench = ODriveBench()
    yield bench
    bench.bus.close()
