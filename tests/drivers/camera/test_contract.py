"""The RGB-D driver keeps the camera contract on a wire, on a spoiled wire and behind a socket."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.base import ByteTransport
from drivers.camera.base import Camera, RgbdFrame
from drivers.camera.protocol import Intrinsics
from drivers.clock import Clock
from drivers.registry import open_camera
from sim_twin.contracts.bench import ServedBench, WireBench, socket_bench
from sim_twin.contracts.camera import (
    RgbdCameraContract,
    RgbdCameraUnplugContract,
    RgbdCameraWireFaultContract,
)
from sim_twin.sensors.camera import CameraDevice

CAMERA = Intrinsics(width=32, height=24, fx=30.0, fy=30.0, cx=15.5, cy=11.5)


def connect(line: ByteTransport, clock: Clock) -> Camera[RgbdFrame]:
    return open_camera("RGBD-STREAM", line, clock, rate_hz=10.0)


def render() -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    return np.full((24, 32, 3), 9, np.uint8), np.ones((24, 32), np.float32)


def device() -> CameraDevice:
    return CameraDevice(render, CAMERA, latency_s=0.03, seed=1)


class TestOnAWire(RgbdCameraContract, RgbdCameraUnplugContract, RgbdCameraWireFaultContract):
    @pytest.fixture
    def bench(self) -> WireBench[Camera[RgbdFrame]]:
        return WireBench(device(), connect)


class TestBehindASocket(RgbdCameraContract, RgbdCameraUnplugContract):
    patience_s = 0.4

    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[Camera[RgbdFrame]]]:
        camera = device()
        bench = socket_bench(camera, connect, tmp_path / "camera", lambda: None)
        yield bench
        bench.close()
