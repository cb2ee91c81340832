from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from drivers.base import ByteTransport
from drivers.camera.rgbd_stream import RgbdCamera
from drivers.dynamixel.tables.control_table import MODELS
from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from drivers.errors import DeviceMissing
from sim_twin.harness.lockstep import Lockstep, MemoryOpener
from sim_twin.servos import WireTiming

HEAD_PAN_ID = 21


def write(servo_id: int, name: str, value: int) -> bytes:
    register = MODELS["XL430-W250"].registers[name]
    address = register.address.to_bytes(2, "little")
    return encode_instruction(servo_id, Instruction.WRITE, address + register.to_bytes(value))


class HeadTurner:
    """Turn the head to and fro over the real bus protocol."""

    period_s = 0.1

    def __init__(self, devices: MemoryOpener) -> None:
        self._devices = devices
        self._goal = 2048
        self.steps = 0

    def start(self) -> None:
        self.line: ByteTransport = self._devices.serial("servos")
        self.line.write(write(HEAD_PAN_ID, "torque_enable", 1))

    def step(self) -> None:
        self._goal = 2448 if self._goal != 2448 else 1648
        self.line.write(write(HEAD_PAN_ID, "goal_position", self._goal))
        self.steps += 1

    def stop(self) -> None:
        self.line.write(write(HEAD_PAN_ID, "torque_enable", 0))


@pytest.fixture
def lockstep(tmp_path: Path) -> Iterator[Lockstep]:
    lockstep = Lockstep(tmp_path=tmp_path)
    yield lockstep
    lockstep.close()


def turn_head(tmp_path: Path, seed: int) -> bytes:
    lockstep = Lockstep(seed=seed, tmp_path=tmp_path)
    lockstep.add(HeadTurner(lockstep.devices))
    lockstep.run_for(0.5)
    lockstep.close()
    data = lockstep.twin.engine.data
    return bytes(data.qpos.tobytes() + data.qvel.tobytes())


def test_the_same_seed_gives_the_same_bits(tmp_path: Path) -> None:
    assert turn_head(tmp_path, 7) == turn_head(tmp_path, 7)


def test_another_seed_gives_other_bits(tmp_path: Path) -> None:
    assert turn_head(tmp_path, 7) != turn_head(tmp_path, 8)


def test_bytes_on_the_servo_bus_move_a_joint_in_the_physics(lockstep: Lockstep) -> None:
    node = HeadTurner(lockstep.devices)
    lockstep.add(node)
    start_s = lockstep.now_s
    assert lockstep.run_until(
        lambda: lockstep.truth()["joints"]["head_pan"]["position"] > 0.1, timeout_s=1.0
    )
    assert node.steps == round((lockstep.now_s - start_s) / 0.1 + 0.5)


def test_run_for_advances_simulated_time_by_just_that(lockstep: Lockstep) -> None:
    start_s = lockstep.now_s
    lockstep.run_for(0.05)
    assert lockstep.now_s - start_s == pytest.approx(0.05)


def test_a_killed_node_leaves_its_servo_powered_and_a_removed_one_does_not(
    lockstep: Lockstep,
) -> None:
    killed = HeadTurner(lockstep.devices)
    lockstep.add(killed)
    lockstep.kill(killed)
    assert lockstep.twin.servos.register(HEAD_PAN_ID, "torque_enable") == 1
    removed = HeadTurner(lockstep.devices)
    lockstep.add(removed)
    lockstep.remove(removed)
    assert lockstep.twin.servos.register(HEAD_PAN_ID, "torque_enable") == 0


def test_the_lidars_bytes_keep_coming(lockstep: Lockstep) -> None:
    line = lockstep.devices.serial("lidar")
    lockstep.run_for(0.2)
    assert len(line.read(100_000, 0)) > 47 * 50


def test_drives_answer_on_the_can_bus(lockstep: Lockstep) -> None:
    bus = lockstep.devices.can("can")
    bus.send(can.Message(arbitration_id=0x601, data=bytes(8), is_extended_id=False))
    answer = bus.recv()
    assert answer is not None
    assert answer.arbitration_id == 0x581


@pytest.mark.gl
def test_the_camera_streams_at_the_rate_asked_for_in_simulated_time(lockstep: Lockstep) -> None:
    camera = RgbdCamera(lockstep.devices.stream("camera"), lockstep.clock)
    camera.start(10.0)
    frames = []
    for _ in range(10):
        lockstep.run_for(0.05)
        frames.append(camera.poll())
    seen = [frame for frame in frames if frame is not None]
    assert len(seen) == 5
    assert seen[0].rgb.shape == (384, 512, 3)
    assert 0.3 < float(np.median(seen[0].depth_m())) < 8.0


@pytest.mark.parametrize("kind", ["serial", "stream", "can"])
def test_a_device_that_is_not_there_is_named(lockstep: Lockstep, kind: str) -> None:
    with pytest.raises(DeviceMissing, match="'toaster'"):
        getattr(lockstep.devices, kind)("toaster")


@pytest.mark.parametrize("timing", [None, WireTiming(baud=1_000_000)])
def test_time_passes_while_a_driver_waits_on_a_paced_servo_bus_only(
    tmp_path: Path, timing: WireTiming | None
) -> None:
    lockstep = Lockstep(tmp_path=tmp_path, servo_timing=timing)
    line = lockstep.devices.serial("servos")
    start_ns = lockstep.twin.now_ns
    line.write(encode_instruction(HEAD_PAN_ID, Instruction.PING))
    assert len(line.read(64, start_ns + 50_000_000)) == 14
    assert (lockstep.twin.now_ns > start_ns) is (timing is not None)
    lockstep.close()
