import struct
from collections.abc import Callable
from typing import Any

import pytest

from drivers.dynamixel.tables.control_table import MODELS
from drivers.dynamixel.wire.codec import BROADCAST_ID, Instruction, StatusError, encode_instruction
from sim_twin.servos import EmulatedServoSpec, ServoBank

ADDRESS_PAST_THE_END = 662


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("torque_enable", 2, StatusError.DATA_RANGE),
        ("operating_mode", 7, StatusError.DATA_RANGE),
        ("position_p_gain", 16_384, StatusError.DATA_RANGE),
        ("position_p_gain", 16_383, StatusError.NONE),
        ("goal_position", 4_096, StatusError.DATA_LIMIT),
        ("goal_position", -1, StatusError.DATA_LIMIT),
        ("goal_position", 4_095, StatusError.NONE),
        ("goal_velocity", 201, StatusError.DATA_LIMIT),
        ("goal_velocity", -200, StatusError.NONE),
        ("present_position", 0, StatusError.ACCESS),
        ("model_number", 1, StatusError.ACCESS),
        ("bus_watchdog", -1, StatusError.DATA_RANGE),
    ],
)
def test_a_written_value_is_judged_by_the_registers_bounds(
    bench: Any, name: str, value: int, expected: StatusError
) -> None:
    before = bench.read(name)
    assert bench.write(name, value) == expected
    assert bench.read(name) == (value if expected == StatusError.NONE else before)


def test_a_goal_is_bounded_by_the_limit_register_of_its_kind(bench: Any) -> None:
    assert bench.write("pwm_limit", 400) == 0
    assert bench.write("goal_pwm", 401) == StatusError.DATA_LIMIT
    assert bench.write("goal_pwm", -400) == 0
    assert bench.write("current_limit", 100) == 0
    assert bench.write("goal_current", -101) == StatusError.DATA_LIMIT


def test_a_write_shorter_than_its_register_is_a_length_error(bench: Any) -> None:
    assert bench.write_bytes(1, 116, b"\x00\x08") == StatusError.DATA_LENGTH
    assert bench.write_bytes(1, 116, b"") == StatusError.DATA_LENGTH


@pytest.mark.parametrize("address", [15, 117, 150, ADDRESS_PAST_THE_END])
def test_a_write_where_no_register_begins_is_an_access_error(bench: Any, address: int) -> None:
    assert bench.write_bytes(1, address, b"\0\0\0\0") == StatusError.ACCESS


def test_a_write_over_several_registers_happens_as_a_whole_or_not_at_all(bench: Any) -> None:
    assert bench.write_bytes(1, 108, struct.pack("<III", 7, 8, 9_999)) == StatusError.DATA_LIMIT
    assert bench.read("profile_acceleration") == 0
    assert bench.write_bytes(1, 108, struct.pack("<III", 7, 8, 2_000)) == StatusError.NONE
    assert [
        bench.read(name) for name in ("profile_acceleration", "profile_velocity", "goal_position")
    ] == [7, 8, 2_000]


def test_a_read_over_gaps_gives_zeros_and_past_the_end_an_access_error(bench: Any) -> None:
    whole = bench.send(1, Instruction.READ, struct.pack("<HH", 0, 147))[0]
    assert whole.error == 0
    assert whole.params[:2] == struct.pack("<H", 1020)
    assert whole.params[14:20] == bytes(6)
    beyond = bench.send(1, Instruction.READ, struct.pack("<HH", ADDRESS_PAST_THE_END, 4))[0]
    assert (beyond.error, beyond.params) == (StatusError.ACCESS, b"")


@pytest.mark.parametrize("name", ["return_delay_time", "operating_mode", "homing_offset", "id"])
def test_the_eeprom_is_locked_while_torque_is_on(bench: Any, name: str) -> None:
    before = bench.read(name)
    assert bench.write("torque_enable", 1) == 0
    assert bench.write(name, 4) == StatusError.ACCESS
    assert bench.read(name) == before
    assert bench.write("torque_enable", 0) == 0
    assert bench.write(name, 4) == StatusError.NONE


@pytest.mark.parametrize("mode", [0, 5])
def test_a_servo_without_current_sensing_refuses_current_modes(
    make_bench: Callable[..., Any], mode: int
) -> None:
    assert make_bench(["XL430-W250"]).write("operating_mode", mode) == StatusError.DATA_RANGE
    assert make_bench(["XM430-W350"]).write("operating_mode", mode) == StatusError.NONE


def test_a_new_operating_mode_resets_gains_profiles_and_goals(bench: Any) -> None:
    changed = {"position_p_gain": 300, "profile_velocity": 50, "goal_pwm": 200, "goal_current": 5}
    for name, value in changed.items():
        assert bench.write(name, value) == 0
    assert bench.write("operating_mode", 3) == 0
    assert {name: bench.read(name) for name in changed} == changed
    assert bench.write("operating_mode", 4) == 0
    defaults = {name: bench.models[0].registers[name].initial for name in changed}
    assert {name: bench.read(name) for name in changed} == defaults


def test_a_reboot_keeps_the_eeprom_and_resets_the_ram(bench: Any) -> None:
    bench.write("return_delay_time", 0)
    bench.write("position_p_gain", 300)
    bench.send(1, Instruction.REBOOT)
    bench.run(0.5)
    assert bench.read("return_delay_time") == 0
    assert bench.read("position_p_gain") == 800


@pytest.mark.parametrize(("option", "id_after", "baud_after"), [(1, 9, 1), (2, 9, 3), (0xFF, 1, 1)])
def test_a_factory_reset_keeps_what_its_option_says(
    bench: Any, option: int, id_after: int, baud_after: int
) -> None:
    bench.write("baud_rate", 3)
    bench.write("return_delay_time", 0)
    bench.write_bytes(1, 7, b"\x09")
    assert bench.send(9, Instruction.FACTORY_RESET, bytes([option]))[0].error == 0
    bench.run(0.5)
    table = bench.send(id_after, Instruction.READ, struct.pack("<HH", 7, 3))[0].params
    assert table == bytes([id_after, baud_after, 250])


@pytest.mark.parametrize(
    ("params", "torque", "expected"),
    [
        (b"", 0, StatusError.DATA_LENGTH),
        (b"\x03", 0, StatusError.DATA_RANGE),
        (b"\x02", 1, StatusError.ACCESS),
    ],
)
def test_a_factory_reset_is_refused_without_an_option_and_with_torque_on(
    bench: Any, params: bytes, torque: int, expected: StatusError
) -> None:
    bench.write("torque_enable", torque)
    assert bench.send(1, Instruction.FACTORY_RESET, params)[0].error == expected
    assert bench.send(1, Instruction.PING)


def test_a_broadcast_cannot_reset_all_ids_at_once(make_bench: Callable[..., Any]) -> None:
    bench = make_bench(["XM430-W350", "XL430-W250"])
    assert bench.send(BROADCAST_ID, Instruction.FACTORY_RESET, b"\xff") == []
    bench.run(0.5)
    assert [reply.servo_id for reply in bench.send(BROADCAST_ID, Instruction.PING)] == [1, 2]


@pytest.mark.parametrize("name", sorted(MODELS))
def test_every_model_starts_with_its_own_defaults(
    make_bench: Callable[..., Any], name: str
) -> None:
    bench = make_bench([name])
    sensed = {"realtime_tick", "moving_status", "present_input_voltage"}
    for register in bench.models[0].registers.values():
        if register.name not in sensed and register.initial is not None:
            assert bench.read(register.name) == register.initial, register.name


def test_a_specification_with_unknown_names_is_refused_with_what_is_expected() -> None:
    with pytest.raises(ValueError, match=r"expected one of .*XM430-W350.*; got AX-12"):
        EmulatedServoSpec(id=1, model_name="AX-12")
    with pytest.raises(ValueError, match=r"not in its EEPROM: \['goal_position'\]"):
        EmulatedServoSpec(id=1, model_name="XM430-W350", eeprom={"goal_position": 1})
    with pytest.raises(ValueError, match=r"baud_rate: expected 0\.\.7, got 9"):
        EmulatedServoSpec(id=1, model_name="XM430-W350", eeprom={"baud_rate": 9})


@pytest.mark.parametrize(
    ("name", "firmware", "expected"),
    [
        ("bus_watchdog", 37, StatusError.ACCESS),
        ("bus_watchdog", 38, StatusError.NONE),
        ("startup_configuration", 44, StatusError.ACCESS),
        ("startup_configuration", 45, StatusError.NONE),
    ],
)
def test_a_register_that_came_with_a_later_firmware_cannot_be_written(
    name: str, firmware: int, expected: StatusError
) -> None:
    bank = ServoBank([EmulatedServoSpec(id=1, model_name="XM430-W350", firmware_version=firmware)])
    address = MODELS["XM430-W350"].registers[name].address
    bank.receive(encode_instruction(1, Instruction.WRITE, struct.pack("<HB", address, 1)))
    assert bank.transmit()[8] == expected
    assert bank.register(1, name) == (expected == StatusError.NONE)
