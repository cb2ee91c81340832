"""A base driven by servos, or by omni wheels: what its robot file may say, and what it may not."""

import shutil
from pathlib import Path

import pytest

from drivers.servo.joint_servo import WheelLimits
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOTS_DIR
from vla_deploy.robots.servos.declared import servo_specs

WHEEL = '{ id = 8, model = "STS3215-C018", joint = "base_back_wheel", sign = 1 },'
BEARINGS = "wheel_bearings_rad = [1.0472, 3.1416, -1.0472]"
FAULTS = {
    "a wheel with the id of a joint": (
        (WHEEL, WHEEL.replace("8", "3", 1)),
        "servo_bus.wheels[1].id: got 3, expected a value not used by servo_bus.servos[2].id",
    ),
    "a wheel that is not in the MJCF": (
        ("base_back_wheel", "base_front_wheel"),
        "servo_bus.wheels[1].joint: got 'base_front_wheel', expected a joint of the MJCF",
    ),
    "a servo without a velocity mode": (
        (WHEEL, WHEEL.replace("STS3215-C018", "XL430-W250")),
        "servo_bus.wheels[1].model: got 'XL430-W250', expected a servo whose driver has a velocity",
    ),
    "a wheel too few": (
        (WHEEL, ""),
        "base.wheel_bearings_rad: got [1.0472, 3.1416, -1.0472], expected one for each of the 2",
    ),
    "wheels that cannot drive sideways": (
        (BEARINGS, "wheel_bearings_rad = [0.0, 0.01, 3.1416]"),
        "base.wheel_bearings_rad: got [0.0, 0.01, 3.1416], expected one for each of the 3 wheels, "
        "at least three that do not lie in line",
    ),
    "two geometries": (
        (BEARINGS, f"track_m = 0.2\n{BEARINGS}"),
        "base.track_m: got both track_m and base_radius_m, expected track_m of two wheels side by",
    ),
    "a track with three wheels": (
        ("base_radius_m = 0.125", "track_m = 0.2"),
        "base.track_m: got 3 wheels, expected 2 with track_m: left, then right",
    ),
    "wheels without a base": (
        ("[base]", "[workspace.unused]\nmin_m = [0, 0, 0]\nmax_m = [1, 1, 1]\n[spare]"),
        "base: got nothing, expected a table: servo_bus.wheels needs it",
    ),
    "a base that nothing drives": (
        ("wheels = [", "unused = ["),
        "can_bus: got nothing, expected a table with the drives of the wheels, or wheels in",
    ),
    "zones, which know no way sideways": (
        ("[clearance]", '[zones.near]\nkind = "stop"\nsources = ["depth"]\n\n[clearance]'),
        "zones: got a table, expected nothing: zones judge motion ahead and turns",
    ),
    "a home without a lidar": (
        ("[clearance]", '[home]\nmap = "m.yaml"\nstart = "a"\nzones = []\n\n[clearance]'),
        "lidar: got nothing, expected a table: [home] needs it",
    ),
}


@pytest.mark.parametrize("case", FAULTS)
def test_the_robot_file_names_what_cannot_drive(tmp_path: Path, case: str) -> None:
    (old, new), expected = FAULTS[case]
    file = Path(shutil.copytree(ROBOTS_DIR / "lekiwi", tmp_path / "lekiwi")) / "robot.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert expected in str(caught.value)


def test_wheels_are_no_joints_but_servos_of_the_bus() -> None:
    robot = load_robot("lekiwi")
    assert robot.wheel_joints == ("base_left_wheel", "base_back_wheel", "base_right_wheel")
    assert not set(robot.wheel_joints) & set(robot.joint_names)
    specs = servo_specs(robot)
    assert [spec.id for spec in specs] == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    limits = WheelLimits(speed_rad_s=4.0, acceleration_rad_s2=pytest.approx(22.25))  # type: ignore[arg-type]
    assert [spec.wheel for spec in specs] == [None] * 6 + [limits] * 3
    assert not robot.finds_its_way
    assert list(robot.places) == ["floor"]
