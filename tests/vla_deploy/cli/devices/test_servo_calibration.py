"""Exchange calibrations with LeRobot, with servos that hold its homing offsets or do not."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vla_deploy.cli.main import main
from vla_deploy.robots.calibration.calibration import CALIBRATION_FILE, read_calibration
from vla_deploy.robots.loader import ROBOTS_DIR

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "so101", tmp_path / "so101"))


def file_of(folder: Path, homing_offset: int) -> Path:
    motors = {
        name: {
            "id": i + 1,
            "drive_mode": 0,
            "homing_offset": homing_offset,
            "range_min": 850,
            "range_max": 3250,
        }
        for i, name in enumerate(JOINTS)
    }
    file = folder / "theirs.json"
    file.write_text(json.dumps(motors, indent=4))
    return file


@pytest.mark.parametrize(
    ("held", "said"), [(-85, {True}), (0, {False}), (300, "holds homing offset 300, expected -85")]
)
def test_the_servos_say_whether_they_hold_the_homing_offsets(
    make_bus: Callable[..., Any],
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    held: int,
    said: Any,
) -> None:
    bus = make_bus.feetech(*range(1, 7), homing_offset=held)
    words = [str(file_of(folder, -85)), "--robot", str(folder), "--port", bus.port]
    code = main(["servo", "calibration", "import", *words])
    if isinstance(said, str):
        assert code == 1
        assert said in capsys.readouterr().err
        assert not (folder / CALIBRATION_FILE).exists()
        return
    assert code == 0
    read = read_calibration(folder / CALIBRATION_FILE)
    assert {
        one.lerobot is not None and one.lerobot.homing_in_servo for one in read.values()
    } == said
    words[0] = str(folder / "ours.json")
    assert main(["servo", "calibration", "export", *words, "--read-servos"]) == 0
    assert (folder / "ours.json").read_text() == (folder / "theirs.json").read_text()
    assert main(["servo", "calibration", "check", *words[1:]]) == 0
    other = make_bus.feetech(*range(1, 7), homing_offset=7)
    words = ["--robot", str(folder), "--port", other.port]
    assert main(["servo", "calibration", "check", *words]) == 1
    assert "elbow_flex: its servo holds homing offset 7, expected" in capsys.readouterr().err


def test_without_the_servos_it_has_to_be_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["servo", "calibration", "import", str(file_of(folder, -85)), "--robot", str(folder)]
    words += ["--port", str(tmp_path / "nothing")]
    assert main(words) == 2
    assert "say what the servos hold, without asking them, with --homing" in capsys.readouterr().err
    assert main([*words, "--homing", "servo"]) == 0
    assert read_calibration(folder / CALIBRATION_FILE)["gripper"].lerobot is not None
