"""A robot on FEETECH servos: the same control and safety, by another driver on another wire."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from sim_twin.harness.lockstep_stack import LockstepControl
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOT_FILE, ROBOTS_DIR

COARSE = str(Path(__file__).parents[2] / "coarse.toml")
HEAD_PAN = 'model = "STS3250", joint = "head_pan"'
FIGURES = """
[servo_models."STS3250"]
stall_torque_nm = 4.9
no_load_speed_rad_s = 7.854
mass_kg = 0.075
source = "test"
"""


def feetech_butler(folder: Path) -> Path:
    """Make a butler all of whose servos are STS3250 on a line of 1 Mbit/s."""
    shutil.copytree(ROBOTS_DIR / "butler", folder)
    file = folder / ROBOT_FILE
    text = file.read_text(encoding="utf-8")
    text = re.sub(r'model = "X[^"]+"', 'model = "STS3250"', text)
    text = re.sub(r'\[servo_models\."X.*?(?=\n\[|\n# ---)', "", text, flags=re.DOTALL)
    text = text.replace("baud = 3000000", "baud = 1000000").replace("\nprotocol = 2\n", "\n")
    file.write_text(text + FIGURES, encoding="utf-8")
    return folder


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[LockstepControl]:
    folder = feetech_butler(tmp_path / "butler")
    made = LockstepControl(tmp_path / "run", 0, COARSE, robot=str(folder))
    yield made
    made.close()


@pytest.fixture
def armed(robot: LockstepControl) -> LockstepControl:
    robot.arm()
    return robot


def at(robot: LockstepControl, joint: str) -> float:
    return float(robot.lockstep.truth()["joints"][joint]["position"])


def test_joints_go_where_they_are_told_and_stay(armed: LockstepControl) -> None:
    armed.go({"head_pan": 0.6, "head_tilt": 0.2, "left_elbow": 0.8})
    armed.lockstep.run_for(3.0)
    assert at(armed, "head_pan") == pytest.approx(0.6, abs=0.02)
    assert at(armed, "head_tilt") == pytest.approx(0.2, abs=0.02)
    assert at(armed, "left_elbow") == pytest.approx(0.8, abs=0.03)
    assert armed.state() == "armed"


def test_an_emergency_stop_stands_and_holds(armed: LockstepControl) -> None:
    armed.go({"left_elbow": 2.0})
    armed.lockstep.run_for(0.6)
    armed.link.operate("estop")
    armed.lockstep.run_for(0.5)
    before = at(armed, "left_elbow")
    armed.lockstep.run_for(1.0)
    assert armed.control_status()["estop_latched"]
    assert at(armed, "left_elbow") == pytest.approx(before, abs=0.01)


def test_a_bus_that_is_lost_leaves_arms_that_hold_and_comes_back(armed: LockstepControl) -> None:
    armed.go({"left_elbow": 1.0})
    armed.lockstep.run_for(3.0)
    armed.lockstep.twin.plugs["servos"].pull()
    armed.lockstep.run_for(2.0)
    status = armed.control_status()
    assert (armed.state(), status["cause"]) == ("stopped", "servo_bus_lost")
    assert at(armed, "left_elbow") == pytest.approx(1.0, abs=0.03), "nothing lets go of it"
    armed.lockstep.twin.plugs["servos"].push()
    armed.lockstep.run_for(2.5)
    armed.arm()
    assert at(armed, "left_elbow") == pytest.approx(1.0, abs=0.03)


def test_an_overload_stops_the_robot_and_a_reset_reboots_the_servo(
    armed: LockstepControl,
) -> None:
    armed.lockstep.twin.servos.overload(22)
    armed.lockstep.run_for(1.0)
    assert armed.state() == "stopped"
    assert "head_tilt" in str(armed.control_status())
    armed.lockstep.twin.servos.overload(22, on=False)
    armed.arm()
    assert armed.state() == "armed"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("baud = 1000000", "baud = 3000000", "servo_bus.baud: got 3000000"),
        (
            'model = "STS3250", joint = "head_pan"',
            'model = "XL430-W250", joint = "head_pan"',
            "speak the same",
        ),
        (
            'model = "STS3250", joint = "head_pan"',
            'model = "STS9999", joint = "head_pan"',
            "STS3215-C018",
        ),
    ],
)
def test_a_bus_that_no_driver_can_run_is_a_fault_of_the_file(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    folder = feetech_butler(tmp_path / "butler")
    file = folder / ROBOT_FILE
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RobotFileError, match=re.escape(words)):
        load_robot(str(folder))
