"""The BNO085 driver keeps the IMU contract on a wire, on a spoiled wire and behind a terminal."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.imu.base import Imu
from drivers.registry import open_imu
from sim_twin.contracts.bench import ServedBench, WireBench, pty_bench
from sim_twin.contracts.imu import ImuContract, ImuUnplugContract, ImuWireFaultContract
from sim_twin.sensors.imu import ImuDevice, ImuTruth

AT_REST = ImuTruth(yaw_rad=0.3, pitch_rad=0.1, roll_rad=0.0, acceleration_m_s2=(0.0, 0.0, 9.81))


def connect(line: ByteTransport, clock: Clock) -> Imu:
    return open_imu("BNO085-RVC", line, clock)


def device() -> ImuDevice:
    return ImuDevice(lambda: AT_REST, seed=1)


class TestOnAWire(ImuContract, ImuUnplugContract, ImuWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Imu]:
        return WireBench(device(), connect)


class TestBehindATerminal(ImuContract, ImuUnplugContract):
    patience_s = 0.2

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Imu]]:
        bench = pty_bench(device(), connect, tmp_path / "imu", 115_200)
        yield bench
        bench.close()
