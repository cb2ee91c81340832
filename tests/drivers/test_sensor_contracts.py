"""Lidar, IMU and RGB-D drivers keep their contracts: on a wire, on a spoiled wire, and served."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.base import ByteTransport
from drivers.camera.base import Camera, RgbdFrame
from drivers.camera.protocol import Intrinsics
from drivers.clock import Clock
from drivers.imu.base import Imu
from drivers.lidar.base import Lidar
from drivers.registry import open_camera, open_imu, open_lidar
from sim_twin.contracts.bench import ServedBench, WireBench, pty_bench, socket_bench
from sim_twin.contracts.camera import (
    RgbdCameraContract,
    RgbdCameraUnplugContract,
    RgbdCameraWireFaultContract,
)
from sim_twin.contracts.imu import ImuContract, ImuUnplugContract, ImuWireFaultContract
from sim_twin.contracts.lidar import LidarContract, LidarUnplugContract, LidarWireFaultContract
from sim_twin.sensors.camera import CameraDevice
from sim_twin.sensors.imu import ImuDevice, ImuTruth
from sim_twin.sensors.lidar import LidarDevice

WORLD_M = np.linspace(1.0, 4.0, 360, dtype=np.float32)
AT_REST = ImuTruth(yaw_rad=0.3, pitch_rad=0.1, roll_rad=0.0, acceleration_m_s2=(0.0, 0.0, 9.81))
OPTICS = Intrinsics(width=32, height=24, fx=30.0, fy=30.0, cx=15.5, cy=11.5)
IMAGE = np.full((24, 32, 3), 9, np.uint8), np.ones((24, 32), np.float32)


def lidar() -> LidarDevice:
    return LidarDevice(lambda beams: WORLD_M.take(beams, mode="wrap"), seed=1)


def imu() -> ImuDevice:
    return ImuDevice(lambda: AT_REST, seed=1)


def camera() -> CameraDevice:
    return CameraDevice(lambda: IMAGE, OPTICS, latency_s=0.03, seed=1)


def connect_lidar(line: ByteTransport, clock: Clock) -> Lidar:
    return open_lidar("LD19", line, clock)


def connect_imu(line: ByteTransport, clock: Clock) -> Imu:
    return open_imu("BNO085-RVC", line, clock)


def connect_camera(line: ByteTransport, clock: Clock) -> Camera[RgbdFrame]:
    return open_camera("RGBD-STREAM", line, clock, rate_hz=10.0)


class TestLidarOnAWire(LidarContract, LidarUnplugContract, LidarWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Lidar]:
        return WireBench(lidar(), connect_lidar)


class TestLidarBehindATerminal(LidarContract, LidarUnplugContract):
    patience_s = 0.35

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Lidar]]:
        bench = pty_bench(lidar(), connect_lidar, tmp_path / "lidar", 230_400)
        yield bench
        bench.close()


class TestImuOnAWire(ImuContract, ImuUnplugContract, ImuWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Imu]:
        return WireBench(imu(), connect_imu)


class TestImuBehindATerminal(ImuContract, ImuUnplugContract):
    patience_s = 0.2

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Imu]]:
        bench = pty_bench(imu(), connect_imu, tmp_path / "imu", 115_200)
        yield bench
        bench.close()


class TestCameraOnAWire(RgbdCameraContract, RgbdCameraUnplugContract, RgbdCameraWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Camera[RgbdFrame]]:
        return WireBench(camera(), connect_camera)


class TestCameraBehindASocket(RgbdCameraContract, RgbdCameraUnplugContract):
    patience_s = 0.4

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Camera[RgbdFrame]]]:
        bench = socket_bench(camera(), connect_camera, tmp_path / "camera", lambda: None)
        yield bench
        bench.close()
