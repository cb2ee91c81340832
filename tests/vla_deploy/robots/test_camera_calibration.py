"""Camera calibration files: what is read, what is refused, and what the robot makes of them."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from drivers.camera.protocol import Intrinsics
from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.calibration.camera_calibration import (
    LENS_FILE,
    MOUNTING_FILE,
    read_lens,
    read_mounting,
    write_lens,
    write_mounting,
)
from vla_deploy.robots.camera import CameraMounting, LensCalibration
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.loader import ROBOTS_DIR

CAMERA = load_robot("butler").camera
LENS = LensCalibration(
    intrinsics=Intrinsics(
        width=512, height=384, fx=354.2, fy=353.4, cx=253.1, cy=194.1,
        distortion=(-0.28, 0.09, 0.0004, -0.0007, -0.01),
    ),
    distortion_model="plumb_bob",
    reprojection_error_px=0.14,
    views=18,
    made_at="2026-11-22T10:00:00+00:00",
    tool="vla-deploy camera calibrate",
)  # fmt: skip
HALF_RAD = math.radians(2.0) / 2
MOUNTING = CameraMounting(
    site=CAMERA.site,
    model=CAMERA.model,
    focal_px=CAMERA.focal_px,
    translation_m=(0.004, -0.002, 0.006),
    quaternion_xyzw=(math.sin(HALF_RAD), 0.0, 0.0, math.cos(HALF_RAD)),
    residual_m=0.0008,
    made_at="2026-11-22T10:05:00+00:00",
)
# As `camera_calibration` of ROS writes it.
OF_ROS = """\
image_width: 512
image_height: 384
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [ 349.6 ,   0.     , 256.3 ,
          0.     , 350.  , 191.0 ,
          0.     ,   0.     ,   1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.2, 0.05, 0.0001, 0., 0.]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [336., 0., 256., 0., 0., 337., 191., 0., 0., 0., 1., 0.]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))


def faults_of(folder: Path) -> str:
    with pytest.raises(RobotFileError) as caught:
        load_robot(folder)
    return str(caught.value)


def test_a_robot_without_the_files_takes_its_camera_as_it_comes() -> None:
    assert (CAMERA.lens, CAMERA.mounting) == (None, None)
    assert CAMERA.intrinsics.fx == CAMERA.focal_px
    assert CAMERA.intrinsics.distortion == ()
    assert np.array_equal(CAMERA.site_from_camera, np.eye(4))


def test_a_lens_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    write_lens(tmp_path / LENS_FILE, LENS, CAMERA)
    assert read_lens(tmp_path / LENS_FILE, CAMERA) == LENS


def test_a_file_of_ros_is_taken_as_it_is(folder: Path) -> None:
    (folder / LENS_FILE).write_text(OF_ROS)
    lens = load_robot(folder).camera.lens
    assert lens is not None
    assert lens.intrinsics.fx == 349.6
    assert lens.intrinsics.distortion == (-0.2, 0.05, 0.0001, 0.0, 0.0)
    assert (lens.reprojection_error_px, lens.made_at) == (None, "")


def test_a_file_without_distortion_is_a_pinhole(folder: Path) -> None:
    (folder / LENS_FILE).write_text(OF_ROS.replace("-0.2, 0.05, 0.0001", "0., 0., 0."))
    assert load_robot(folder).camera.intrinsics.distortion == ()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("image_width: 512", "image_width: 640", "image_width: got 640, expected 512"),
        ("349.6", "34.96", "camera_matrix.data fx: got 34.96"),
        ("349.6", ".nan", "camera_matrix.data: got"),
        ("256.3", "4.0", "camera_matrix.data cx: got 4"),
        ("350. ", "528.", "camera_matrix.data fy: got 528"),
        ("plumb_bob", "equidistant", "fisheye lenses, are not supported"),
        ("plumb_bob", "rational_polynomial", "8 finite numbers for rational_polynomial"),
        ("-0.2, 0.05", "-0.2, .inf", "distortion_coefficients.data: got"),
        ("-0.2, 0.05", "-0.9, 0.0", "folds back"),
        ("[1., 0., 0., 0., 1.", "[2., 0., 0., 0., 1.", "expected a rotation"),
        ("[1., 0., 0., 0., 1., 0., 0., 0., 1.]", "[0., 1., 0., -1., 0., 0., 0., 0., 1.]", "pair"),
        ("image_width", "camera_model: D435\nimage_width", "camera_model: got 'D435'"),
        ("camera_matrix:", "camera_matrix: 7\nother:", "camera_matrix.data: got 7"),
        ("image_width: 512", "image_width: [", "a YAML document"),
    ],
)
def test_what_cannot_be_this_camera_is_refused_with_the_reason(
    folder: Path, old: str, new: str, told: str
) -> None:
    assert old in OF_ROS
    (folder / LENS_FILE).write_text(OF_ROS.replace(old, new, 1))
    message = faults_of(folder)
    assert told in message
    assert LENS_FILE in message


def test_all_faults_of_a_lens_are_told_at_once(folder: Path) -> None:
    (folder / LENS_FILE).write_text(
        OF_ROS.replace("512", "640").replace("384", "480").replace("349.6", "2.0")
    )
    message = faults_of(folder)
    for key in ("image_width", "image_height", "data fx"):
        assert key in message


@pytest.mark.parametrize("garbage", [b"\xff\xfe\x00", b"", b"- 1\n- 2\n", b"%"])
def test_garbage_is_no_lens(folder: Path, garbage: bytes) -> None:
    (folder / LENS_FILE).write_bytes(garbage)
    assert f"{LENS_FILE}: (file)" in faults_of(folder)


def test_the_camera_sits_where_its_mounting_says(folder: Path) -> None:
    write_mounting(folder / MOUNTING_FILE, MOUNTING)
    robot = load_robot(folder)
    positions = full_positions(robot)
    drawn = RobotModel(robot).site_pose(CAMERA.site, positions)
    moved = np.linalg.inv(drawn) @ RobotModel(robot).camera_pose(positions)
    assert moved[:3, 3] == pytest.approx(MOUNTING.translation_m)
    c, s = math.cos(2 * HALF_RAD), math.sin(2 * HALF_RAD)
    assert moved[:3, :3] == pytest.approx(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("head_camera", "chest_camera", "site: got 'chest_camera'"),
        ("RGBD-STREAM", "D435", "model: got 'D435'"),
        ("0.004", "0.4", "translation_m: got 0.400 m"),
        ("0.004", "nan", "translation_m: got"),
        ("0.9998", "0.5998", "expected a rotation"),
        ("focal_px = 3", "focal_px = 4", "run `vla-deploy camera hand-eye` again"),
        ("residual_m", "residue_m", "residue_m"),
        ("[", "[[", "a TOML document"),
    ],
)
def test_a_mounting_that_cannot_be_is_refused(folder: Path, old: str, new: str, told: str) -> None:
    file = folder / MOUNTING_FILE
    write_mounting(file, MOUNTING)
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    message = faults_of(folder)
    assert told in message
    assert MOUNTING_FILE in message


def test_a_turn_beyond_any_mounting_is_refused(tmp_path: Path) -> None:
    file = tmp_path / MOUNTING_FILE
    write_mounting(file, MOUNTING)
    turned = file.read_text().replace(str(HALF_RAD)[:6], "x")
    half = math.radians(30.0) / 2
    row = f"quaternion_xyzw = [{math.sin(half)}, 0.0, 0.0, {math.cos(half)}]"
    lines = [row if line.startswith("quaternion") else line for line in turned.splitlines()]
    file.write_text("\n".join(lines))
    with pytest.raises(RobotFileError, match="at most 12 degrees"):
        read_mounting(file, CAMERA)


def test_a_mounting_measured_through_another_lens_is_stale(folder: Path) -> None:
    write_mounting(folder / MOUNTING_FILE, MOUNTING)
    write_lens(folder / LENS_FILE, LENS, CAMERA)
    assert "focal_px" in faults_of(folder)


def test_the_lens_before_stays_as_a_backup(tmp_path: Path) -> None:
    file = tmp_path / LENS_FILE
    for _ in range(2):
        write_lens(file, LENS, CAMERA)
    assert yaml.safe_load((tmp_path / f"{LENS_FILE}.bak").read_text())["views"] == 18


def test_a_folder_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match="--output"):
        write_lens(tmp_path / "nowhere" / LENS_FILE, LENS, CAMERA)
