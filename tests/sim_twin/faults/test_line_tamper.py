import numpy as np
import pytest

from drivers.camera.protocol import BYTES_PER_PIXEL, CRC, HEADER_BYTES, Intrinsics
from drivers.camera.rgbd_stream import RgbdCamera
from drivers.imu.bno085_rvc import FRAME_BYTES, Bno085Rvc
from sim_twin.faults.line_tamper import Garbage, Latency, LineTamper, Stuck
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.camera import CameraDevice
from sim_twin.sensors.imu import ImuDevice, ImuTruth

STEP_NS = 2_000_000


class Host:
    """Step an emulated IMU and read it through a line that can be tampered with."""

    def __init__(self) -> None:
        self.time_ns = 0
        self.yaw_rad = 0.0
        self.device = ImuDevice(self._truth, seed=3)
        self.line = LineTamper(self.device, self.now_ns, FRAME_BYTES)
        self.imu = Bno085Rvc(MemoryLine(self.line, self), self)

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("a polled sensor never waits")

    def _truth(self) -> ImuTruth:
        return ImuTruth(
            yaw_rad=self.yaw_rad, pitch_rad=0.0, roll_rad=0.0, acceleration_m_s2=(0.0, 0.0, 9.8)
        )

    def samples(self, seconds: float) -> list:
        found = []
        for _ in range(round(seconds * 1e9 / STEP_NS)):
            self.time_ns += STEP_NS
            self.yaw_rad += 1e-3
            self.device.step(self.time_ns)
            found += self.imu.poll()
        return found


@pytest.fixture
def host() -> Host:
    host = Host()
    assert len(host.samples(0.5)) == 50
    return host


def test_a_stuck_sensor_repeats_its_last_frame_byte_by_byte_and_none_is_believed(
    host: Host,
) -> None:
    host.line.add(Stuck(host.line))
    before = host.imu.counters.repeated_frames
    assert host.samples(0.2) == []
    assert host.imu.counters.repeated_frames - before == 20
    assert host.imu.counters.checksum_errors == 0


def test_garbage_has_the_length_of_what_it_replaces_and_repeats_with_its_seed(host: Host) -> None:
    def noise(seed: int) -> list[bytes]:
        garbage = Garbage(seed)
        return [garbage.said(bytes(19), 0) for _ in range(5)]

    assert noise(1) == noise(1)
    assert noise(1) != noise(2)
    assert {len(piece) for piece in noise(1)} == {19}
    host.line.add(Garbage(1))
    assert host.samples(1.0) == []


def test_a_latency_delays_every_byte_and_loses_none(host: Host) -> None:
    host.line.add(Latency(0.1))
    late = host.samples(1.0)
    assert len(late) == 90
    assert host.imu.counters.lost_frames == 0


def test_a_bus_repeats_its_last_answer_of_the_same_length() -> None:
    class Bus:
        answers = iter([b"state1", b"ok", b"state2", b"no"])

        def receive(self, data: bytes) -> None: ...

        def transmit(self) -> bytes:
            return next(self.answers)

        def step(self, now_ns: int) -> None: ...

    line = LineTamper(Bus(), lambda: 0)
    assert [line.transmit(), line.transmit()] == [b"state1", b"ok"]
    line.add(Stuck(line))
    assert [line.transmit(), line.transmit()] == [b"state1", b"ok"]


class Watch:
    """A device that reports the time it was stepped to."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.asked_ns = 0

    def receive(self, data: bytes) -> None:
        self.asked_ns = self.now_ns

    def transmit(self) -> bytes:
        return str(self.now_ns).encode()

    def step(self, now_ns: int) -> None:
        self.now_ns = now_ns


def test_every_access_to_a_line_steps_its_device() -> None:
    watch, times_ns = Watch(), iter([3, 8])
    line = LineTamper(watch, lambda: next(times_ns))
    line.receive(b"?")
    assert (watch.asked_ns, line.transmit()) == (3, b"8")


def test_a_line_does_not_step_a_device_that_is_stepped_elsewhere() -> None:
    watch = Watch()
    line = LineTamper(watch, lambda: 3, tells_time=False)
    line.receive(b"?")
    assert (watch.asked_ns, line.transmit()) == (0, b"0")


def test_a_stuck_camera_shows_nothing_new(host: Host) -> None:
    image = np.zeros((1, 2, 3), np.uint8), np.ones((1, 2), np.float32)
    intrinsics = Intrinsics(width=2, height=1, fx=1.0, fy=1.0, cx=0.5, cy=0.0)
    device = CameraDevice(lambda: image, intrinsics, depth_sigma_per_m=0.0)
    line = LineTamper(device, host.now_ns, HEADER_BYTES + 2 * BYTES_PER_PIXEL + CRC.size)
    camera = RgbdCamera(MemoryLine(line, host), host)
    camera.start(10.0)

    def frames(count: int) -> int:
        seen = 0
        for _ in range(count):
            host.time_ns += 100_000_000
            device.step(host.time_ns)
            seen += camera.poll() is not None
        return seen

    assert frames(5) == 5
    line.add(Stuck(line))
    assert frames(15) == 0
    assert camera.counters.repeated_frames == 15
    assert camera.counters.crc_errors == 0
