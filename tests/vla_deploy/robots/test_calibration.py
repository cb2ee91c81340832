import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    read_calibration,
    write_calibration,
)
from vla_deploy.robots.loader import ROBOTS_DIR

ELBOW = JointCalibration(
    servo_id=3, sign=-1, offset=1.3125, method="ends", made_at="2026-11-21T10:00:00+00:00"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))


def faults_of(folder: Path) -> dict[str, str]:
    with pytest.raises(RobotFileError) as caught:
        load_robot(folder)
    return {fault.key: str(fault) for fault in caught.value.faults}


def test_a_calibration_replaces_sign_and_offset_of_its_joint_alone(folder: Path) -> None:
    before = load_robot(folder)
    write_calibration(folder / CALIBRATION_FILE, {"left_elbow": ELBOW})
    after = load_robot(folder)
    for old, new in zip(before.servo_bus.servos, after.servo_bus.servos, strict=True):
        if new.joint == "left_elbow":
            assert new == replace(old, sign=-1, offset=1.3125)
        else:
            assert new == old


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    written = {"left_elbow": ELBOW, 'odd "name"': replace(ELBOW, servo_id=9, offset=-1e-9)}
    write_calibration(tmp_path / CALIBRATION_FILE, written)
    assert read_calibration(tmp_path / CALIBRATION_FILE) == written


def test_the_file_before_stays_as_a_backup(tmp_path: Path) -> None:
    file = tmp_path / CALIBRATION_FILE
    write_calibration(file, {"left_elbow": ELBOW})
    old = file.read_text()
    write_calibration(file, {"left_elbow": replace(ELBOW, offset=1.0)})
    assert (tmp_path / "calibration.toml.bak").read_text() == old
    assert read_calibration(file)["left_elbow"].offset == 1.0
    assert {path.name for path in tmp_path.iterdir()} == {
        CALIBRATION_FILE,
        "calibration.toml.bak",
    }


def test_a_write_that_fails_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / CALIBRATION_FILE
    write_calibration(file, {"left_elbow": ELBOW})

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(RobotFileError, match="No space left on device, expected a file that can"):
        write_calibration(file, {})
    assert read_calibration(file) == {"left_elbow": ELBOW}
    assert [path.name for path in tmp_path.iterdir()] == [CALIBRATION_FILE]


def test_no_file_is_no_calibration(tmp_path: Path) -> None:
    assert read_calibration(tmp_path / CALIBRATION_FILE) == {}


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("joints = 3", "joints", "expected a table"),
        ("[joints.left_elbow]\nsign = 1", "joints.left_elbow.offset", "expected a number"),
        ("[joints]\nleft_elbow = 4", "joints.left_elbow.sign", "one of -1, 1"),
        ("not toml", "(file)", "a TOML document"),
        ("other = 1\n[joints]", "other", "unknown key"),
    ],
)
def test_faults_of_the_file_are_told_with_those_of_the_robot_file(
    folder: Path, text: str, key: str, words: str
) -> None:
    (folder / CALIBRATION_FILE).write_text(text)
    robot = (folder / "robot.toml").read_text()
    (folder / "robot.toml").write_text(robot.replace("track_m = 0.34", "track_m = -1.0"))
    faults = faults_of(folder)
    assert words in faults[f"{CALIBRATION_FILE}: {key}"]
    assert "base.track_m" in faults


def test_a_joint_that_the_robot_lacks_is_a_fault(folder: Path) -> None:
    write_calibration(folder / CALIBRATION_FILE, {"left_knee": ELBOW})
    assert "a servo's joint: " in faults_of(folder)["calibration.toml: joints.left_knee"]


def test_a_calibration_of_another_servo_is_refused(folder: Path) -> None:
    write_calibration(folder / CALIBRATION_FILE, {"left_elbow": replace(ELBOW, servo_id=33)})
    told = faults_of(folder)["calibration.toml: joints.left_elbow.servo_id"]
    assert "got 33, expected 3, the id in the robot file: calibrate the joint again" in told


def test_an_offset_with_which_a_servo_cannot_reach_its_limits_is_a_fault(folder: Path) -> None:
    write_calibration(folder / CALIBRATION_FILE, {"left_elbow": replace(ELBOW, offset=5.0)})
    assert "limits.left_elbow.min" in faults_of(folder)
