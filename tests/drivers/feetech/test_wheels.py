"""Servos that turn wheels beside servos of joints: velocity mode, zero before anything else."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.feetech.bus import FeetechBus
from drivers.feetech.codec import FeetechInstruction, encode_packet
from drivers.feetech.servo import FeetechServo
from drivers.feetech.table import STEP_RAD
from drivers.servo.joint_servo import WheelLimits
from drivers.servo.wheeled_bus import WheeledBus

LIMITS = WheelLimits(speed_rad_s=4.0, acceleration_rad_s2=22.25)
JOINT = FeetechServo(id=1, model_name="STS3215-C018", joint="pan")
WHEELS = tuple(
    FeetechServo(id=one, model_name="STS3215-C018", joint=f"wheel_{one}", sign=sign, wheel=LIMITS)
    for one, sign in ((7, 1), (8, -1), (9, 1))
)
HALT = bytes.fromhex("ff ff fe 0d 83 2e 02 07 00 00 08 00 00 09 00 00")


@pytest.fixture
def bench(make_bench: Callable[..., Any]) -> Any:
    return make_bench(servos=(JOINT, *WHEELS))


def driven(bench: Any) -> WheeledBus:
    bus = WheeledBus(bench.bus, 3)
    bus.connect()
    bus.enable_torque([1, 7, 8, 9])
    bus.read_state()
    return bus


def registers(bench: Any, name: str) -> list[int]:
    return [bench.bank.register(servo.id, name) for servo in WHEELS]


def wait(bench: Any, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        bench.run(0.05)


def test_connecting_halts_the_wheels_first_and_sets_their_mode(bench: Any) -> None:
    bench.bus.connect()
    first = bench.sent[0]
    assert encode_packet(first.servo_id, first.code, first.params)[:-1] == HALT
    assert registers(bench, "operating_mode") == [1, 1, 1]
    assert bench.bank.register(1, "operating_mode") == 0


def test_speeds_are_one_sync_write_of_sign_and_magnitude(bench: Any) -> None:
    bus = driven(bench)
    bench.sent.clear()
    bus.write_speeds(np.array([1.0, 1.0, -9.0]))
    (sent,) = bench.sent
    frame = encode_packet(sent.servo_id, sent.code, sent.params)
    # 652 steps/s, 652 the other way for a wheel of sign -1, and the limit of 2607 backwards
    assert frame.hex(" ") == "ff ff fe 0d 83 2e 02 07 8c 02 08 8c 82 09 2f 8a d4"


def test_wheels_turn_at_their_speeds_beside_a_joint_that_holds(bench: Any) -> None:
    bus = driven(bench)
    assert registers(bench, "acceleration") == [146, 146, 146]  # 22.25 rad/s^2, rounded up
    for _ in range(100):
        bus.write_goals(np.array([0.3]))
        bus.write_speeds(np.array([1.0, 1.0, -2.0]))
        bench.run(0.01)
    state = bus.read_state()
    assert state.position_rad == pytest.approx([0.3], abs=0.02)
    assert bus.wheels.velocity_rad_s == pytest.approx([1.0, 1.0, -2.0], abs=0.05)
    assert len(state.torque_on) == 1
    assert bus.wheels.torque_on.all()


def test_nobody_stops_a_wheel_but_the_next_bus_does_so_at_once(bench: Any) -> None:
    bus = driven(bench)
    bus.write_speeds(np.array([1.0, 0.0, -1.0]))
    wait(bench, 3.0)  # the host is silent: these servos have no bus watchdog
    assert abs(registers(bench, "present_velocity")[0]) > 600
    again: FeetechBus = bench.new_bus()
    again.connect()
    wait(bench, 0.3)
    assert registers(bench, "goal_velocity") == [0, 0, 0]
    assert max(map(abs, registers(bench, "present_velocity"))) < 20


def test_a_silent_wheel_is_told_to_stand_and_returns_standing(bench: Any) -> None:
    bus = driven(bench)
    moving = np.array([1.0, 1.0, 1.0])
    bench.bank.silence(8)
    for _ in range(20):
        bus.write_speeds(moving)
        bench.run(0.01)
        bus.read_state()
    last = next(one for one in reversed(bench.sent) if one.code == FeetechInstruction.SYNC_WRITE)
    assert last.params[2:] == bytes.fromhex("07 8c 02 08 00 00 09 8c 02")
    bench.bank.silence(8, silent=False)
    for _ in range(200):
        bus.read_state()
        bench.run(0.004)
    assert bus.wheels.valid.all()
    assert registers(bench, "goal_velocity")[1] == 0


@pytest.mark.parametrize(
    ("servos", "expected"),
    [((WHEELS[0], JOINT), "joints first"), (WHEELS, "joints first")],
)
def test_wheels_come_last_and_never_alone(
    bench: Any, servos: tuple[FeetechServo, ...], expected: str
) -> None:
    with pytest.raises(ValueError, match=expected):
        FeetechBus(bench.line, bench, servos, baud=1_000_000)


def test_a_model_without_velocity_mode_turns_no_wheel() -> None:
    with pytest.raises(ValueError, match="SCS0009 has no velocity mode"):
        FeetechServo(id=1, model_name="SCS0009", joint="wheel", wheel=LIMITS)
    assert pytest.approx(STEP_RAD * 652, abs=1e-3) == 1.0
