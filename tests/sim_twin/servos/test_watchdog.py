import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.wire.codec import BROADCAST_ID, Instruction, StatusError, encode_instruction
from sim_twin.servos import FirmwareOptions

CENTRE = 2048
PERIODS = 5  # of 20 ms
FAR = CENTRE + 1500


def arm(bench: Any, servo_id: int = 1) -> None:
    assert bench.write("bus_watchdog", PERIODS, servo_id) == 0
    assert bench.write("torque_enable", 1, servo_id) == 0


def watchdog(bench: Any, servo_id: int = 1) -> int:
    """Read without a packet on the bus, which would feed the watchdog."""
    value: int = bench.bank.register(servo_id, "bus_watchdog")
    return value


def test_it_trips_after_its_time_of_silence_and_not_before(bench: Any) -> None:
    arm(bench)
    bench.run(0.098)
    assert watchdog(bench) == PERIODS
    bench.run(0.004)
    assert watchdog(bench) == -1
    assert bench.read("bus_watchdog") == -1


@pytest.mark.parametrize(("periods", "torque"), [(PERIODS, [0]), (0, [1]), (PERIODS, [1, 0])])
def test_it_does_not_run_without_torque_or_at_zero(
    bench: Any, periods: int, torque: list[int]
) -> None:
    bench.write("bus_watchdog", periods)
    for value in torque:
        bench.write("torque_enable", value)
    bench.run(3.0)
    assert watchdog(bench) == periods


@pytest.mark.parametrize(
    "packet",
    [
        encode_instruction(1, Instruction.PING),
        encode_instruction(1, Instruction.READ, b"\x84\x00\x04\x00"),
        encode_instruction(1, Instruction.WRITE, b"\x00\x00\x01"),
        encode_instruction(BROADCAST_ID, Instruction.PING),
        encode_instruction(BROADCAST_ID, Instruction.SYNC_READ, b"\x84\x00\x04\x00\x02\x01"),
        encode_instruction(BROADCAST_ID, Instruction.FAST_SYNC_READ, b"\x84\x00\x04\x00\x01"),
        encode_instruction(BROADCAST_ID, Instruction.SYNC_WRITE, b"\x41\x00\x01\x00\x01\x01"),
        encode_instruction(BROADCAST_ID, Instruction.BULK_READ, b"\x01\x84\x00\x04\x00"),
    ],
)
def test_every_packet_for_the_servo_feeds_it(bench: Any, packet: bytes) -> None:
    arm(bench)
    for _ in range(6):
        bench.run(0.08)
        bench.bank.receive(packet)
    assert watchdog(bench) == PERIODS


@pytest.mark.parametrize(
    "packet",
    [
        encode_instruction(2, Instruction.PING),
        encode_instruction(BROADCAST_ID, Instruction.SYNC_READ, b"\x84\x00\x04\x00\x02"),
    ],
)
@pytest.mark.parametrize("fed_by_any", [False, True])
def test_a_packet_for_others_feeds_it_only_where_that_is_chosen(
    make_bench: Callable[..., Any], packet: bytes, fed_by_any: bool
) -> None:
    options = FirmwareOptions(watchdog_fed_by_any_packet=fed_by_any)
    bench = make_bench(["XM430-W350", "XL430-W250"], options=options)
    arm(bench)
    for _ in range(3):
        bench.run(0.08)
        bench.bank.receive(packet)
    assert watchdog(bench) == (PERIODS if fed_by_any else -1)


def test_broken_packets_do_not_feed_it(bench: Any) -> None:
    arm(bench)
    packet = bytearray(encode_instruction(1, Instruction.PING))
    packet[-1] ^= 1
    for _ in range(3):
        bench.run(0.04)
        bench.bank.receive(bytes(packet))
    assert watchdog(bench) == -1


def test_a_trip_stops_a_moving_servo_and_holds_it(bench: Any) -> None:
    arm(bench)
    bench.write("profile_velocity", 40)
    bench.write("profile_acceleration", 5)
    bench.write("goal_position", FAR)
    bench.run(0.09)
    bench.write("led", 1)
    bench.run(0.102)
    at_trip = bench.bank.register(1, "present_position")
    assert watchdog(bench) == -1
    bench.run(0.1)
    assert abs(bench.rotors.velocity_rad_s[0]) < 0.02
    assert bench.read("present_position") == pytest.approx(at_trip, abs=40)
    assert (bench.read("profile_velocity"), bench.read("profile_acceleration")) == (0, 0)
    assert bench.read("torque_enable") == 1
    bench.run(1.0)
    assert abs(bench.rotors.velocity_rad_s[0]) < 0.02


@pytest.mark.parametrize(
    ("mode", "goal", "value"),
    [
        (OperatingMode.VELOCITY, "goal_velocity", 100),
        (OperatingMode.PWM, "goal_pwm", 400),
        (OperatingMode.CURRENT, "goal_current", 200),
    ],
)
def test_a_trip_ends_the_drive_of_the_other_modes(
    bench: Any, mode: OperatingMode, goal: str, value: int
) -> None:
    bench.write("operating_mode", mode)
    arm(bench)
    bench.write(goal, value)
    bench.run(0.05)
    assert bench.rotors.velocity_rad_s[0] > 0.1
    bench.run(1.0)
    assert abs(bench.rotors.velocity_rad_s[0]) < 0.02 or mode == OperatingMode.CURRENT
    assert abs(bench.rotors.torque_nm[0]) < 0.02


def test_tripped_it_refuses_goals_until_zero_is_written(bench: Any) -> None:
    arm(bench)
    bench.run(0.11)
    held = bench.read("goal_position")
    assert bench.write("goal_position", 100) == StatusError.DATA_RANGE
    assert bench.write("goal_velocity", 1) == StatusError.DATA_RANGE
    assert bench.write("bus_watchdog", PERIODS) == StatusError.DATA_RANGE
    bench.sync_write(116, 4, {1: struct.pack("<i", 100)})
    assert bench.read("goal_position") == held
    assert bench.write("led", 1) == 0
    assert bench.write("bus_watchdog", 0) == 0
    assert bench.read("bus_watchdog") == 0
    assert bench.write("goal_position", held + 50) == 0
    assert bench.write("bus_watchdog", PERIODS) == 0
    bench.run(0.11)
    assert watchdog(bench) == -1


def test_a_trip_outlives_torque_off_but_not_a_reboot(bench: Any) -> None:
    arm(bench)
    bench.run(0.11)
    bench.write("torque_enable", 0)
    assert bench.read("bus_watchdog") == -1
    bench.send(1, Instruction.REBOOT)
    bench.run(0.3)
    assert bench.read("bus_watchdog") == 0


def test_time_alone_trips_it_without_physics(bench: Any) -> None:
    arm(bench)
    bench.bank.step(bench.now_ns + 90_000_000)
    assert watchdog(bench) == PERIODS
    bench.bank.step(bench.now_ns + 101_000_000)
    assert watchdog(bench) == -1


def test_every_servo_has_its_own(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(["XM430-W350", "XM540-W270"])
    arm(bench, 1)
    arm(bench, 2)
    for _ in range(3):
        bench.run(0.05)
        bench.send(2, Instruction.PING)
    assert (watchdog(bench, 1), watchdog(bench, 2)) == (-1, PERIODS)


def test_a_tripped_servo_keeps_the_setpoint_it_had(make_bench: Callable[..., Any]) -> None:
    bench = make_bench()
    arm(bench)
    bench.write("goal_position", CENTRE + 40)
    bench.run(0.2)
    assert watchdog(bench) == -1
    assert bench.bank.register(1, "goal_position") == CENTRE + 40


def test_a_tripped_servo_in_mid_profile_stops_where_its_trajectory_is(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench()
    bench.write("profile_velocity", 40)
    arm(bench)
    bench.write("goal_position", FAR)
    bench.run(0.3)
    held = bench.bank.register(1, "goal_position")
    assert CENTRE < held < FAR
    bench.run(0.5)
    assert bench.bank.register(1, "present_position") == pytest.approx(held, abs=2)


def test_the_option_makes_a_tripped_servo_take_its_present_position_as_goal(
    make_bench: Callable[..., Any],
) -> None:
    bench = make_bench(options=FirmwareOptions(trip_holds_present=True))
    bench.blocked = True
    arm(bench)
    bench.write("goal_position", CENTRE + 40)
    bench.run(0.2)
    assert watchdog(bench) == -1
    assert bench.bank.register(1, "goal_position") == CENTRE
