"""Emulated drives keep the contract that real ones are asked to keep."""

from typing import Any

import pytest

from drivers.wheel_drives.bus import DriveBus
from sim_twin.contracts.drive_bus import DriveBusContract, DrivePowerContract


class LockstepBench:
    """Open the driver of a small world again and again."""

    def __init__(self, bench: Any) -> None:
        self._bench = bench
        self.clock = bench.world

    def open(self) -> DriveBus:
        bus: DriveBus = type(self._bench).on(self._bench.world)
        bus.connect()
        return bus

    def let(self, seconds: float) -> None:
        self._bench.pause(seconds)


class TestCia402(DriveBusContract, DrivePowerContract):
    @pytest.fixture
    def bench(self, cia402: Any) -> LockstepBench:
        return LockstepBench(cia402)


class TestODrive(DriveBusContract, DrivePowerContract):
    @pytest.fixture
    def bench(self, odrive: Any) -> LockstepBench:
        return LockstepBench(odrive)
