import json
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivers.camera.protocol import CameraCommand, Intrinsics, encode_request
from sim_twin.faults.camera_relay import NO_FAULTS, CameraBench, CameraFaults, faults_in_force
from sim_twin.faults.injector import FaultInjector
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.sensors.camera import CameraDevice
from vla_deploy.robots import load_robot

PERIOD_NS = 100_000_000


class Bench:
    """Hold a camera of two pixels at both ends of the relay."""

    def __init__(self) -> None:
        self.time_ns = 0
        intrinsics = Intrinsics(width=2, height=1, fx=1.0, fy=1.0, cx=0.5, cy=0.0)
        image = np.zeros((1, 2, 3), np.uint8), np.ones((1, 2), np.float32)
        self.device = CameraDevice(lambda: image, intrinsics, depth_sigma_per_m=0.0)
        line = LineTamper(self.device, lambda: self.time_ns)
        camera = cast("Any", SimpleNamespace(device=self.device))
        bench = CameraBench(load_robot("butler"), camera, line, lambda: self.time_ns)
        self.line = line
        self.twin_side = FaultInjector(cast("Any", bench))
        self.camera_side = CameraFaults(bench)
        self.device.receive(encode_request(CameraCommand.START, 10.0))

    def frame(self) -> bytes:
        self.time_ns += PERIOD_NS
        self.device.step(self.time_ns)
        return self.line.transmit()


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_nothing_in_force_is_an_empty_list(bench: Bench) -> None:
    assert faults_in_force(bench.twin_side) == NO_FAULTS
    bench.twin_side.inject("servo", 3, "delayed", start_s=9.0)
    bench.twin_side.inject("camera", None, "off", start_s=9.0)
    assert faults_in_force(bench.twin_side) == NO_FAULTS


def test_a_fault_is_applied_at_the_other_end_and_removed(bench: Bench) -> None:
    whole = bench.frame()
    bench.camera_side.follow(json.dumps([{"fault": "off", "seed": 0}]))
    assert bench.frame() == b""
    bench.camera_side.follow(NO_FAULTS)
    assert len(bench.frame()) == len(whole)


def test_parameters_travel(bench: Bench) -> None:
    bench.camera_side.follow(json.dumps([{"fault": "wrong", "seed": 0, "ratio": 0.25}]))
    assert bench.device.depth_ratio == 0.25


def test_a_fault_that_comes_and_goes_travels_as_what_it_is_while_it_is_on(bench: Bench) -> None:
    bench.twin_side.inject("camera", None, "intermittent", of="off", period_s=0.4)
    reported = []
    for _ in range(4):
        bench.twin_side.step()
        reported.append([fault["fault"] for fault in json.loads(faults_in_force(bench.twin_side))])
        bench.time_ns += PERIOD_NS
    assert reported == [["off"], ["off"], [], []]
