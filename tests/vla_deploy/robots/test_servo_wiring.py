"""Supplies and second servos of a robot: judged in its file, and by what the servos measure."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.control.judging.thresholds import safety_limits
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOTS_DIR
from vla_deploy.robots.supplies import voltage_mismatches

KOCH = load_robot("koch_v1_1")
SHADOW = 'id = 3, model = "XM430-W350", joint = "shoulder"'
ARM = "voltage_v = 5.0, servos = [3, 4, 5, 6]"
FAULTS = {
    "a supply that its servos do not stand": (
        (ARM, ARM.replace("5.0", "12.0")),
        "servo_bus.supplies[1].voltage_v: got 12 V, expected what servo 3 (XL330-M288) stands",
    ),
    "a servo without a supply": (
        (ARM, ARM.replace(", 6]", "]")),
        "servo_bus.supplies: got none that feeds servo 6, expected each servo on one supply",
    ),
    "a servo on two supplies": (
        (ARM, ARM.replace("[3", "[2, 3")),
        "servo_bus.supplies[1].servos: got 2, expected a value not used by servo_bus.supplies[0]",
    ),
    "a servo that is not there": (
        (ARM, ARM.replace("6]", "6, 7]")),
        "servo_bus.supplies[1].servos: got 7, expected ids of the servos of this bus",
    ),
    "two supplies of one name": (
        ('name = "arm"', 'name = "shoulder"'),
        "servo_bus.supplies[1].name: got 'shoulder', expected a value not used by",
    ),
    "two servos of one id": (
        (SHADOW, SHADOW.replace("3", "4", 1)),
        "servo_bus.shadows[0].id: got 4, expected a value not used by servo_bus.servos[2].id",
    ),
    "a shadow of nothing": (
        (SHADOW, SHADOW.replace("shoulder", "hip")),
        "servo_bus.shadows[0].joint: got 'hip', expected a servo's joint: elbow, forearm_roll",
    ),
    "a shadow of another model": (
        (SHADOW, SHADOW.replace("XM430-W350", "XL430-W250")),
        "servo_bus.shadows[0].model: got 'XL430-W250', expected XM430-W350, as the servo that it",
    ),
    "no supplies where no voltage suits all": (
        ("supplies = [", "[servo_bus.unused]\nlist = ["),
        "servo_bus.supplies: got nothing, so 12 V for all, as servo 1 needs, "
        "expected a table for each supply: servo 3 (XL330-M288) stands: 3.5..7 V",
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_the_robot_file_names_what_cannot_be(tmp_path: Path, case: str) -> None:
    (old, new), expected = FAULTS[case]
    robot = "wx250s" if old == SHADOW else "koch_v1_1"
    file = Path(shutil.copytree(ROBOTS_DIR / robot, tmp_path / robot)) / "robot.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert expected in str(caught.value)


def test_limits_are_those_of_the_supply_within_those_of_the_model() -> None:
    limits, so101 = safety_limits(KOCH), safety_limits(load_robot("so101"))
    assert limits.voltage_min_v == pytest.approx([9.0, 9.0, 3.8, 3.8, 3.8, 3.8])
    assert limits.voltage_max_v == pytest.approx([13.7, 13.7, 6.0, 6.0, 6.0, 6.0])
    assert so101.voltage_min_v == pytest.approx([9.3] * 6)  # none declared: the model's alone


def test_a_mismatch_names_the_supply_and_each_of_its_servos() -> None:
    assert voltage_mismatches(KOCH.servo_bus, {1: 11.9, 2: 11.8, 3: 5.0, 6: 4.7}) == []
    assert voltage_mismatches(KOCH.servo_bus, {1: 5.0, 2: 5.1, 3: 5.0}) == [
        "supply shoulder (12 V): servo 1 (shoulder_pan) has 5.0 V, expected 9.0..14.0 V; "
        "servo 2 (shoulder_lift) has 5.1 V, expected 9.0..14.0 V"
    ]
    bus = load_robot("so101").servo_bus
    assert voltage_mismatches(bus, {1: 7.4}) == [
        "the supply: servo 1 (shoulder_pan) has 7.4 V, expected 9.0..14.0 V"
    ]


def test_two_servos_give_a_joint_the_torque_of_both() -> None:
    robot = load_robot("wx250s")
    assert robot.stall_effort("shoulder") == pytest.approx(8.2)
    assert robot.stall_effort("waist") == pytest.approx(4.1)
    assert [one.joint for one in robot.servo_bus.all_servos][-2:] == [
        "shoulder_shadow",
        "elbow_shadow",
    ]
