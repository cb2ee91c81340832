import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.devices import Servo
from vla_deploy.robots.loader import ROBOTS_DIR

SITES = '<site name="lidar"/><site name="imu"/><site name="head_camera"/>'


def small_robot(
    folder: Path, inside: str, joints: Sequence[str], around: str = "", **fields: Any
) -> RobotDescription:
    """Return a robot without wheels and hands whose root body has this inside it."""
    path = folder / "small.xml"
    body = f'<body name="base">{SITES}{inside}</body>'
    path.write_text(f"<mujoco>{around}<worldbody>{body}</worldbody></mujoco>")
    butler = load_robot("butler")
    servos = tuple(
        Servo(id=i, model="XM430-W350", joint=name, sign=1, offset=0.0, travel_per_rad=1.0)
        for i, name in enumerate(joints)
    )
    given = {
        "servo_bus": replace(butler.servo_bus, servos=servos),
        "parts": replace(butler.parts, can_bus=replace(butler.can_bus, drives=())),
        "limits": dict.fromkeys(joints, butler.limits["left_elbow"]),
        "hands": {},
    }
    return replace(butler, mjcf_path=path, **{**given, **fields})


@pytest.fixture
def small(tmp_path: Path) -> Callable[..., RobotDescription]:
    """Build small robots, each in place of the one before."""

    def small(inside: str, *joints: str, around: str = "", **fields: Any) -> RobotDescription:
        return small_robot(tmp_path, inside, joints, around, **fields)

    return small


@pytest.fixture
def butler_copy(tmp_path: Path) -> Path:
    """The robot file of a copy of Butler."""
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler")) / "robot.toml"
