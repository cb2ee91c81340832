"""The LD19 driver keeps the lidar contract on a wire, on a spoiled wire and behind a terminal."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.lidar.base import Lidar
from drivers.registry import open_lidar
from sim_twin.contracts.bench import ServedBench, WireBench, pty_bench
from sim_twin.contracts.lidar import LidarContract, LidarUnplugContract, LidarWireFaultContract
from sim_twin.sensors.lidar import LidarDevice

WORLD_M = np.linspace(1.0, 4.0, 360, dtype=np.float32)


def connect(line: ByteTransport, clock: Clock) -> Lidar:
    return open_lidar("LD19", line, clock)


def device() -> LidarDevice:
    return LidarDevice(lambda beams: WORLD_M.take(beams, mode="wrap"), seed=1)


class TestOnAWire(LidarContract, LidarUnplugContract, LidarWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Lidar]:
        return WireBench(device(), connect)


class TestBehindATerminal(LidarContract, LidarUnplugContract):
    patience_s = 0.35

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Lidar]]:
        bench = pty_bench(device(), connect, tmp_path / "lidar", 230_400)
        yield bench
        bench.close()
