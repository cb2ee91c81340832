"""Calibration files of LeRobot: read, written, taken over and given back; its units."""

import json
import shutil
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    read_calibration,
    write_calibration,
)
from vla_deploy.robots.calibration.lerobot_conversion import exported, imported
from vla_deploy.robots.calibration.lerobot_file import LeRobotMotor, read_lerobot, write_lerobot
from vla_deploy.robots.calibration.lerobot_units import LeRobotUnit, LeRobotUnits
from vla_deploy.robots.loader import ROBOTS_DIR

RANGES = {  # of one arm; the roll is not swept
    "shoulder_pan": (736, 3475),
    "shoulder_lift": (815, 3199),
    "elbow_flex": (850, 3063),
    "wrist_flex": (811, 3183),
    "wrist_roll": (0, 4095),
    "gripper": (1499, 3010),
}
ARM = {
    name: LeRobotMotor(
        id=i + 1, drive_mode=0, homing_offset=31 * i - 60, range_min=low, range_max=high
    )
    for i, (name, (low, high)) in enumerate(RANGES.items())
}
IN_SERVO = dict.fromkeys(ARM, True)
NOT_IN_SERVO = dict.fromkeys(ARM, False)
SO101 = load_robot("so101")
FILE = Path("my_arm.json")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "so101", tmp_path / "so101"))


@pytest.mark.parametrize("in_servo", [IN_SERVO, NOT_IN_SERVO])
def test_what_is_imported_is_exported_as_it_was(folder: Path, in_servo: dict[str, bool]) -> None:
    turned = ARM | {"gripper": replace(ARM["gripper"], drive_mode=1)}
    write_lerobot(folder / "theirs.json", turned)
    found = imported(SO101, read_lerobot(folder / "theirs.json"), {}, in_servo, FILE)
    write_calibration(folder / CALIBRATION_FILE, found)
    robot = load_robot(folder)
    read = read_calibration(folder / CALIBRATION_FILE)
    assert read == found
    assert exported(robot, read) == turned
    assert imported(robot, turned, read, in_servo, FILE) == found


def test_what_was_measured_here_survives_the_way_to_lerobot_and_back(folder: Path) -> None:
    measured = {
        "elbow_flex": JointCalibration(
            servo_id=3, sign=-1, offset=0.123457, method="ends", made_at="2026-11-21"
        )
    }
    write_calibration(folder / CALIBRATION_FILE, measured)
    robot = load_robot(folder)
    sent = exported(robot, measured)
    assert imported(robot, sent, measured, IN_SERVO, FILE) == measured
    # Without our file, as on another computer, LeRobot's whole pulses are all there is.
    anew = imported(robot, sent, {}, NOT_IN_SERVO, FILE)["elbow_flex"]
    assert (anew.sign, anew.offset) == (-1, pytest.approx(0.123457, abs=0.5 * np.pi / 2048))


def test_the_middle_of_a_sweep_is_the_middle_of_the_range_and_a_closed_gripper_is_closed() -> None:
    found = imported(SO101, ARM, {}, IN_SERVO, FILE)
    pulse = 2 * np.pi / 4096
    assert found["elbow_flex"].offset == pytest.approx((2048 - (850 + 3063) / 2) * pulse, abs=1e-6)
    assert found["gripper"].offset == pytest.approx(-0.174533 + (2048 - 1499) * pulse, abs=1e-6)
    # A servo without LeRobot's offset shows so much more: FEETECH shows position - offset.
    shifted = imported(SO101, ARM, {}, NOT_IN_SERVO, FILE)
    moved = shifted["elbow_flex"].offset - found["elbow_flex"].offset
    assert moved == pytest.approx(-ARM["elbow_flex"].homing_offset * pulse, abs=2e-6)


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("elbow_flex", {"id": 9}, "elbow_flex.id: got 9, expected 3, the id in the robot file"),
        ("elbow_flex", {"range_max": 1400}, "got 550 pulses, expected at least 1322 pulses"),
        ("elbow_flex", {"range_max": 850}, "elbow_flex.range_max: got 850, expected above"),
        ("elbow_flex", {"drive_mode": 2}, "elbow_flex.drive_mode: got 2, expected one of 0, 1"),
        ("elbow_flex", {"range_min": float("nan")}, "range_min: got nan, expected an integer"),
        ("elbow_flex", {"range_min": 850.5}, "range_min: got 850.5, expected an integer"),
        ("elbow_flex", {"homing": 3}, "elbow_flex.homing: got an unknown key"),
        ("shoulder_roll", {}, "shoulder_roll: got 'shoulder_roll', expected a servo's joint"),
        ("wrist_flex", {"range_min": 2000, "range_max": 4095}, "0..4095 at the joint's limits"),
    ],
)
def test_a_file_that_does_not_fit_is_refused(
    tmp_path: Path, name: str, change: dict[str, Any], words: str
) -> None:
    document = {one: asdict(motor) for one, motor in ARM.items()}
    document[name] = {**document.get(name, asdict(ARM["gripper"])), **change}
    (tmp_path / "bad.json").write_text(json.dumps(document))
    with pytest.raises(RobotFileError) as caught:
        imported(SO101, read_lerobot(tmp_path / "bad.json"), {}, IN_SERVO, FILE)
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"a": 3}', '{"a": {}}'])
def test_what_is_no_calibration_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(RobotFileError):
        read_lerobot(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("unit", "pulses", "expected"),
    [  # by the formulas of motors_bus.py, by hand
        (LeRobotUnit.DEGREES, [736, 2007, 3063, 1997, 4095, 1499], [-120.4, 0, 97.27, 0, 180, 0]),
        (LeRobotUnit.RANGE, [736, 2007, 3063, 1404, 4095, 3010], [-100, 0, 100, -50, 100, 100]),
    ],
)
def test_units_are_those_of_lerobot(
    unit: LeRobotUnit, pulses: list[int], expected: list[float]
) -> None:
    offsets = np.array([servo.offset for servo in SO101.servo_bus.servos])
    joints = offsets + (np.array(pulses) - 2048) * 2 * np.pi / 4096
    calibrations = {
        name: replace(one, offset=float(offset))
        for (name, one), offset in zip(
            imported(SO101, ARM, {}, IN_SERVO, FILE).items(), offsets, strict=True
        )
    }
    units = LeRobotUnits(SO101, calibrations, unit)
    values = units.to_lerobot(joints)
    np.testing.assert_allclose(values, expected, atol=0.01)
    np.testing.assert_allclose(units.to_joints(values), joints, atol=1e-9)


def test_lerobot_reads_what_is_written_and_has_the_same_units(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        why = "LeRobot's own loader is asked where it is installed: pip install 'lerobot[feetech]'"
        pytest.importorskip("lerobot.motors.feetech", reason=why, exc_type=ImportError)
        import draccus
        from lerobot.motors import Motor, MotorCalibration, MotorNormMode
        from lerobot.motors.feetech import FeetechMotorsBus
    write_lerobot(tmp_path / "arm.json", ARM)
    with (tmp_path / "arm.json").open() as file, draccus.config_type("json"):
        theirs = draccus.load(dict[str, MotorCalibration], file)
    assert {name: asdict(one) for name, one in theirs.items()} == {
        name: asdict(one) for name, one in ARM.items()
    }
    with (tmp_path / "theirs.json").open("w") as file, draccus.config_type("json"):
        draccus.dump(theirs, file, indent=4)
    assert (tmp_path / "theirs.json").read_text() == (tmp_path / "arm.json").read_text()
    calibrations = imported(SO101, ARM, {}, IN_SERVO, FILE)
    robot = replace(
        SO101,
        servo_bus=replace(
            SO101.servo_bus,
            servos=tuple(
                replace(servo, offset=calibrations[servo.joint].offset)
                for servo in SO101.servo_bus.servos
            ),
        ),
    )
    pulses = np.array([800, 1500, 2047, 3000, 4000, 2500])
    offsets = np.array([calibrations[name].offset for name in ARM])
    joints = offsets + (pulses - 2048) * 2 * np.pi / 4096
    for unit, mode in (
        (LeRobotUnit.DEGREES, MotorNormMode.DEGREES),
        (LeRobotUnit.RANGE, MotorNormMode.RANGE_M100_100),
    ):
        motors = {
            name: Motor(one.id, "sts3215", MotorNormMode.RANGE_0_100 if name == "gripper" else mode)
            for name, one in ARM.items()
        }
        bus = FeetechMotorsBus(port="/dev/null", motors=motors, calibration=theirs)
        by_id = bus._normalize(dict(enumerate(pulses.tolist(), start=1)))
        values = LeRobotUnits(robot, calibrations, unit).to_lerobot(joints)
        np.testing.assert_allclose(values, [by_id[i] for i in range(1, 7)], atol=1e-3)
