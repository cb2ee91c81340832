"""What `overrides.toml` says goes before the robot file, and its faults bear its name."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.calibration.calibration import (
    CALIBRATION_FILE,
    JointCalibration,
    write_calibration,
)
from vla_deploy.robots.loader import OVERRIDES_FILE, ROBOTS_DIR


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))


def faults_of(folder: Path, overrides: str) -> dict[str, str]:
    (folder / OVERRIDES_FILE).write_text(overrides)
    with pytest.raises(RobotFileError) as caught:
        load_robot(folder)
    return {fault.key: str(fault) for fault in caught.value.faults}


def test_tables_merge_and_lists_are_replaced_whole(folder: Path) -> None:
    own = load_robot(folder)
    (folder / OVERRIDES_FILE).write_text(
        "[base]\nmax_speed_m_s = 0.2\n[home]\nzones = []\n[planning]\nfurther_plans = 1\n"
        "[home.places.porch]\nx_m = 1.0\ny_m = 2.5\nyaw_rad = 0.0\naliases = []\nviewpoints = []\n"
    )
    robot = load_robot(folder)
    assert robot.base.max_speed_m_s == 0.2
    assert robot.base.track_m == own.base.track_m
    assert own.home.zones
    assert robot.home.zones == ()
    assert robot.planning.further_plans == 1
    assert robot.planning.payload_kg == own.planning.payload_kg
    assert set(robot.places) == {*own.places, "porch"}


def test_a_calibration_goes_before_the_overrides(folder: Path) -> None:
    elbow = JointCalibration(servo_id=3, sign=-1, offset=1.25, method="ends", made_at="today")
    write_calibration(folder / CALIBRATION_FILE, {"left_elbow": elbow})
    (folder / OVERRIDES_FILE).write_text("[base]\nmax_speed_m_s = 0.2\n")
    robot = load_robot(folder)
    (servo,) = [one for one in robot.servo_bus.servos if one.joint == "left_elbow"]
    assert (servo.offset, robot.base.max_speed_m_s) == (1.25, 0.2)


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("[base]\ntrack_m = -1.0", "base.track_m", "a number above 0"),
        ("base = 3", "base", "expected a table"),
        ("[base]\ncolour = 'red'", "base.colour", "unknown key"),
        ("colour = 'red'", "colour", "unknown key"),
        ("[workspace.tail]\nmin_m = 3", "workspace.tail.max_m", "got nothing"),
        ("[home]\nzones = [{ name = 'a' }]", "home.zones[0].reason", "got nothing"),
        ("[home]\nstart = 'moon'", "home.start", "a place"),
        ("[planning]\nfurther_plans = 99", "planning.further_plans", "an integer in 0..20"),
        ("[planning]\naction_timeout_s = 0", "planning.action_timeout_s", "above 0"),
        ("not toml", "(file)", "a TOML file"),
    ],
)
def test_its_faults_name_it(folder: Path, text: str, key: str, words: str) -> None:
    assert words in faults_of(folder, text)[f"{OVERRIDES_FILE}: {key}"]


def test_faults_of_the_robot_file_do_not(folder: Path) -> None:
    file = folder / "robot.toml"
    file.write_text(file.read_text().replace("track_m = 0.34", "track_m = -1.0"))
    faults = faults_of(folder, "[base]\nwheel_radius_m = -2.0")
    assert set(faults) == {"base.track_m", f"{OVERRIDES_FILE}: base.wheel_radius_m"}
