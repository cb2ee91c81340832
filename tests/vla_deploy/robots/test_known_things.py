"""A camera without depth is a mounted robot's, which knows the sizes of things."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.known_things import KnownThing
from vla_deploy.robots.loader import OVERRIDES_FILE, ROBOTS_DIR

WEBCAM = '[camera]\nmodel = "V4L2"\npath = "/dev/video0"\n'
BLOCK = '[[things]]\nclass = "block"\nsize_m = [0.025, 0.02, 0.03]\n'


def robot_folder(tmp_path: Path, name: str, overrides: str) -> Path:
    folder = Path(shutil.copytree(ROBOTS_DIR / name, tmp_path / name))
    (folder / OVERRIDES_FILE).write_text(overrides)
    return folder


def test_an_override_makes_the_camera_a_webcam(tmp_path: Path) -> None:
    robot = load_robot(robot_folder(tmp_path, "so101", WEBCAM + BLOCK))
    assert not robot.camera.has_depth
    assert robot.camera.path == "/dev/video0"
    assert robot.things == (KnownThing(class_name="block", size_m=(0.025, 0.02, 0.03)),)
    own = load_robot("so101")
    assert (own.camera.has_depth, own.things) == (True, ())


@pytest.mark.parametrize(
    ("name", "overrides", "key", "words"),
    [
        ("so101", WEBCAM, "things", "a camera without depth places things by their sizes"),
        ("butler", WEBCAM + BLOCK, "camera.model", "on a robot with a base or a head"),
        ("so101", BLOCK.replace("0.025, ", ""), "things[0].size_m", "length, width and height"),
        ("so101", BLOCK.replace("0.025", "-1"), "things[0].size_m", "above 0"),
        ("so101", BLOCK.replace("class", "kind"), "things[0].class", "got nothing"),
    ],
    ids=["no sizes", "a base", "two sides", "negative", "no class"],
)
def test_faults_are_named(tmp_path: Path, name: str, overrides: str, key: str, words: str) -> None:
    with pytest.raises(RobotFileError) as caught:
        load_robot(robot_folder(tmp_path, name, overrides))
    faults = {
        fault.key.removeprefix(f"{OVERRIDES_FILE}: "): str(fault) for fault in caught.value.faults
    }
    assert words in faults[key]
