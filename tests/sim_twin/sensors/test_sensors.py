"""The emulated sensors against the real drivers, on a simulated clock."""

import copy
import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.base import RgbdFrame
from drivers.camera.protocol import Intrinsics
from drivers.camera.rgbd_stream import RgbdCamera
from drivers.imu.base import ImuSample
from drivers.imu.bno085_rvc import Bno085Rvc
from drivers.lidar.base import Scan
from drivers.lidar.ld19 import Ld19
from sim_twin.contracts.scripted import ScriptedLine
from sim_twin.device import WireDevice
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.camera import CameraDevice
from sim_twin.sensors.imu import ImuDevice, ImuTruth
from sim_twin.sensors.lidar import LidarDevice

STEP_NS = 2_000_000


class Line(MemoryLine):
    """Join a device and a driver; waiting on this line steps the device."""

    def __init__(self, device: WireDevice) -> None:
        super().__init__(device, self)
        self.device = device
        self.now = 10**9

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        while self.now < deadline_ns:
            self.now += STEP_NS
            self.device.step(self.now)


def scans_of(device: LidarDevice, seconds: float, mounting_yaw_rad: float = 0.0) -> list[Scan]:
    line = Line(device)
    lidar = Ld19(line, line, mounting_yaw_rad=mounting_yaw_rad)
    scans = []
    for _ in range(round(seconds / 0.02)):
        line.sleep_until(line.now + 20_000_000)
        if (scan := lidar.poll()) is not None:
            scans.append(scan)
    assert lidar.counters.crc_errors == lidar.counters.discarded_bytes == 0
    return scans


@pytest.mark.parametrize("mounting_yaw_rad", [0.0, math.pi / 2, -2.0])
def test_the_lidar_shows_the_world_where_it_is_whatever_the_mounting(
    mounting_yaw_rad: float,
) -> None:
    truth = np.linspace(1.0, 4.0, 360, dtype=np.float32)
    truth[40:50] = 0.0
    device = LidarDevice(
        lambda beams: truth.take(beams, mode="wrap"), sigma_m=0.0, mounting_yaw_rad=mounting_yaw_rad
    )
    scans = scans_of(device, 0.5, mounting_yaw_rad)
    assert len(scans) == 4
    assert np.all(scans[-1].range_m[41:49] == 0.0)
    seen = scans[-1].range_m > 0
    assert np.abs(scans[-1].range_m - truth)[seen].max() < 0.02
    assert np.count_nonzero(seen) >= 348


def test_lidar_noise_has_the_declared_size_and_repeats_with_the_seed() -> None:
    truth = np.full(360, 2.0, dtype=np.float32)

    def run(seed: int) -> NDArray[np.float32]:
        scans = scans_of(
            LidarDevice(lambda beams: truth.take(beams, mode="wrap"), sigma_m=0.005, seed=seed), 1.2
        )
        return np.concatenate([s.range_m for s in scans])

    first = run(3)
    assert 0.003 < float(np.std(first)) < 0.006
    assert np.array_equal(first, run(3))
    assert not np.array_equal(first, run(4))


def test_beams_carry_the_time_at_which_they_were_measured() -> None:
    started = 10**9

    def cast(beams: range) -> NDArray[np.float32]:
        return np.full(len(beams), 1.0 + (line.now - started) / 1e9, dtype=np.float32)

    device = LidarDevice(cast, sigma_m=0.0)
    line = Line(device)
    lidar = Ld19(line, line)
    scan = None
    for _ in range(30):
        line.sleep_until(line.now + 20_000_000)
        scan = lidar.poll() or scan
    assert scan is not None
    measured_s = scan.range_m - 1.0
    stamped_s = (scan.beam_stamp_ns - started) / 1e9
    # The emulation casts every 33 ms and a packet holds 2.7 ms.
    assert np.abs(measured_s - stamped_s).max() < 0.04


@pytest.mark.parametrize("held_up_s", [1, 3600])
def test_a_lidar_that_was_held_up_goes_on_with_what_a_line_would_have_kept(held_up_s: int) -> None:
    looks: list[range] = []

    def cast(beams: range) -> NDArray[np.float32]:
        looks.append(beams)
        return np.ones(len(beams), np.float32)

    line = Line(LidarDevice(cast))
    lidar = Ld19(line, line)
    line.sleep_until(line.now + 10 * STEP_NS)
    lidar.poll()
    line.now += held_up_s * 10**9
    line.sleep_until(line.now + STEP_NS)
    before = lidar.counters.packets
    lidar.poll()
    # And what it had measured before.
    assert 375 // 5 <= lidar.counters.packets - before <= 375 // 5 + 375 // 30
    ages_ns = []
    for _ in range(50):
        line.sleep_until(line.now + 5 * STEP_NS)
        if (scan := lidar.poll()) is not None:
            ages_ns.append(line.now - scan.stamp_ns)
    assert len(ages_ns) == 5
    assert max(ages_ns) < 40_000_000
    assert lidar.counters.crc_errors == lidar.counters.discarded_bytes == 0
    assert len(looks) < 30


@pytest.mark.parametrize(
    "device",
    [
        LidarDevice(lambda beams: np.ones(len(beams), np.float32)),
        ImuDevice(
            lambda: ImuTruth(
                yaw_rad=0.0, pitch_rad=0.0, roll_rad=0.0, acceleration_m_s2=(0.0, 0.0, 9.81)
            )
        ),
    ],
    ids=["lidar", "imu"],
)
def test_a_sensor_stepped_only_when_due_and_when_read_says_the_same(
    device: LidarDevice | ImuDevice,
) -> None:
    always, now_ns = copy.deepcopy(device), 10**9
    said: list[tuple[bytes, bytes]] = []
    for number in range(500):
        now_ns += STEP_NS
        always.step(now_ns)
        if now_ns >= device.due_ns:
            device.step(now_ns)
        if number % 7 == 0:
            device.step(now_ns)
            said.append((device.transmit(), always.transmit()))
    assert all(rarely == often for rarely, often in said)
    assert sum(len(rarely) for rarely, _ in said) > 1_500


def imu_samples(device: ImuDevice, seconds: float) -> list[ImuSample]:
    line = Line(device)
    imu = Bno085Rvc(line, line)
    samples: list[ImuSample] = []
    for _ in range(round(seconds / 0.02)):
        line.sleep_until(line.now + 20_000_000)
        samples += imu.poll()
    assert imu.counters.checksum_errors == imu.counters.lost_frames == 0
    return samples


def test_the_imu_reports_yaw_since_power_on_and_gravity() -> None:
    truths = iter(range(10**6))

    def read() -> ImuTruth:
        return ImuTruth(
            yaw_rad=3.0 + 0.01 * next(truths),
            pitch_rad=0.1,
            roll_rad=-0.2,
            acceleration_m_s2=(0.0, 0.0, 9.81),
        )

    samples = imu_samples(ImuDevice(read), 1.0)
    assert len(samples) == pytest.approx(100, abs=2)
    yaw = np.unwrap([s.yaw_rad for s in samples])
    assert yaw[-1] - yaw[0] == pytest.approx(0.01 * (len(samples) - 1), abs=0.01)
    assert abs(samples[0].yaw_rad) < 0.02
    assert samples[0].pitch_rad == pytest.approx(0.1, abs=0.005)
    assert samples[0].roll_rad == pytest.approx(-0.2, abs=0.005)
    assert samples[0].acceleration_m_s2[2] == pytest.approx(9.81, abs=0.2)


def test_imu_drift_stays_below_half_a_degree_a_minute() -> None:
    still = ImuTruth(yaw_rad=0, pitch_rad=0, roll_rad=0, acceleration_m_s2=(0, 0, 9.81))
    samples = imu_samples(ImuDevice(lambda: still, seed=5), 10.0)
    last = np.mean([s.yaw_rad for s in samples[-100:]])
    assert 1e-6 < abs(last) < math.radians(0.5) / 6.0 + 1e-4


CAMERA = Intrinsics(width=32, height=24, fx=30.0, fy=30.0, cx=15.5, cy=11.5)


@dataclass
class Scenery:
    renders: int = 0

    def render(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        self.renders += 1
        rgb = np.full((24, 32, 3), self.renders, dtype=np.uint8)
        depth = np.full((24, 32), 1.0, dtype=np.float32)
        depth[0] = 50.0
        return rgb, depth


def run_camera(
    seconds: float, rate_hz: float, **options: float
) -> tuple[list[RgbdFrame], Scenery, Line]:
    scenery = Scenery()
    line = Line(CameraDevice(scenery.render, CAMERA, **options))  # type: ignore[arg-type]
    camera = RgbdCamera(line, line)
    if rate_hz:
        camera.start(rate_hz)
    frames = []
    for _ in range(round(seconds / 0.02)):
        line.sleep_until(line.now + 20_000_000)
        if (frame := camera.poll()) is not None:
            frames.append(frame)
    return frames, scenery, line


def test_the_camera_renders_only_when_asked() -> None:
    frames, scenery, _ = run_camera(1.0, 0.0)
    assert frames == []
    assert scenery.renders == 0


def test_a_camera_without_depth_sends_colours_alone() -> None:
    frames, _, _ = run_camera(1.0, 5.0, has_depth=False)
    assert [int(one.rgb[0, 0, 0]) for one in frames] == list(range(1, len(frames) + 1))
    assert not any(one.depth.any() for one in frames)


def test_the_camera_keeps_the_asked_rate() -> None:
    frames, scenery, _ = run_camera(2.0, 5.0)
    assert len(frames) == scenery.renders == 10
    assert np.diff([f.stamp_ns for f in frames]) == pytest.approx(2e8, abs=2e6)
    assert [f.rgb[0, 0, 0] for f in frames] == list(range(1, 11))


def test_depth_noise_grows_with_the_square_of_distance_and_far_is_no_depth() -> None:
    frames, _, _ = run_camera(2.0, 5.0)
    depth = np.stack([f.depth_m() for f in frames])
    assert np.all(depth[:, 0] == 0.0)
    assert 0.0010 < float(np.std(depth[:, 1:])) < 0.0015
    clean, _, _ = run_camera(0.5, 5.0, depth_sigma_per_m=0.0)
    assert np.all(clean[0].depth[1:] == 1000)


def test_latency_delays_delivery_and_no_stamp() -> None:
    frames, late, _ = run_camera(0.95, 5.0, latency_s=0.16)
    prompt, _, _ = run_camera(0.95, 5.0)
    assert (len(frames), len(prompt), late.renders) == (4, 5, 5)
    assert frames[0].stamp_ns - prompt[0].stamp_ns == pytest.approx(0.0, abs=20e6)


def test_a_restarted_request_with_the_same_rate_keeps_the_cadence() -> None:
    scenery = Scenery()
    line = Line(CameraDevice(scenery.render, CAMERA))
    camera = RgbdCamera(line, line)
    for _ in range(10):
        camera.start(5.0)
        line.sleep_until(line.now + 20_000_000)
    assert scenery.renders == 1


def test_requests_are_found_in_garbage_and_in_pieces() -> None:
    scenery = Scenery()
    device = CameraDevice(scenery.render, CAMERA)
    line = Line(device)
    device.receive(b"xxVRGC\x01garbage....VR")
    request = ScriptedLine()
    RgbdCamera(request, line).start(10.0)
    for byte in request.sent:
        device.receive(bytes([byte]))
    line.sleep_until(line.now + 20_000_000)
    assert scenery.renders == 1
