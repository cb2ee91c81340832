"""Lock, EEPROM, signs and what a host may write."""

from typing import Any

import pytest

from drivers.feetech.codec import FeetechInstruction
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank


@pytest.mark.parametrize(("lock", "kept"), [(1, 32), (0, 16)])
def test_what_is_written_with_lock_1_is_lost_with_the_power(
    bench: Any, lock: int, kept: int
) -> None:
    bench.write("lock", lock)
    bench.write("position_p_gain", 16)
    assert bench.read("position_p_gain") == 16
    bench.reboot()
    assert bench.read("position_p_gain") == kept
    assert bench.read("lock") == 1


def test_an_id_that_is_not_kept_comes_back_with_the_power(bench: Any) -> None:
    bench.write("id", 9)
    assert bench.send(1, FeetechInstruction.PING) == []
    bench.reboot(9)
    assert bench.error() == 0


def test_the_torque_limit_comes_from_the_eeprom_at_power_on(bench: Any) -> None:
    bench.write("lock", 0)
    bench.write("max_torque_limit", 500)
    assert bench.read("torque_limit") == 1000
    bench.reboot()
    assert bench.read("torque_limit") == 500


@pytest.mark.parametrize(
    ("address", "data", "name", "value"),
    [
        (3, b"\x01\x01", "model_number", 777),
        (56, b"\x01\x01", "present_position", 2048),
        (5, b"\xfe", "id", 1),
        (33, b"\x09", "operating_mode", 0),
        (40, b"\x07", "torque_enable", 0),
        (40, b"\x01", "torque_enable", 1),
        (42, b"\x05", "goal_position", 2053),  # half a register
    ],
)
def test_what_does_not_exist_or_is_read_only_is_ignored(
    bench: Any, address: int, data: bytes, name: str, value: int
) -> None:
    (reply,) = bench.send(1, FeetechInstruction.WRITE, bytes([address]) + data)
    assert reply.code == 0
    assert bench.read(name) == value


def test_homing_offset_has_its_sign_in_bit_11_and_is_taken_off(bench: Any) -> None:
    bench.write("homing_offset", -100)
    (reply,) = bench.send(1, FeetechInstruction.READ, b"\x1f\x02")
    assert int.from_bytes(reply.params, "little") == 100 | 1 << 11
    bench.run(0.01)
    assert bench.read("present_position") == 2148


def test_torque_enable_128_makes_the_present_position_2048(bench: Any) -> None:
    bench.turn_to(700)
    bench.write("torque_enable", 128)
    bench.run(0.01)
    assert bench.read("present_position") == 2048
    assert bench.read("homing_offset") == 700 - 2048
    assert bench.read("torque_enable") == 0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"model_name": "XM430-W350"}, "model: expected one of"),
        ({"id": 254}, r"id: expected 0\.\.253"),
        ({"eeprom": {"goal_position": 1}}, "not in its EEPROM"),
        ({"eeprom": {"homing_offset": 3000}}, r"homing_offset: expected -2047\.\.2047, got 3000"),
    ],
)
def test_a_servo_that_cannot_be_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        EmulatedFeetechSpec(**{"id": 1, "model_name": "STS3215-C018", **changes})


def test_two_servos_of_one_id_are_refused() -> None:
    with pytest.raises(ValueError, match="all different"):
        FeetechBank([EmulatedFeetechSpec(id=1, model_name="STS3250")] * 2)
