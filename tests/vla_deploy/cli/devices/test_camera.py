"""`vla-deploy camera`: from images, or a robot that runs, to files that are in force."""

import functools
import json
import math
import shutil
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.cli.main import main
from vla_deploy.perception.camera_tools.board import CalibrationBoard
from vla_deploy.perception.camera_tools.head_images import live_images
from vla_deploy.perception.geometry.lens import rays_of
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel, full_positions
from vla_deploy.robots.loader import ROBOTS_DIR

Array = NDArray[np.float64]
BOARD = CalibrationBoard(square_m=0.055)
LENS = Intrinsics(
    width=320, height=240, fx=221.0, fy=222.5, cx=157.0, cy=122.5, distortion=(-0.2, 0.05, 0, 0, 0)
)
PRINT = cv2.resize(BOARD.image(), None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
HEAD = [(pan, tilt) for pan in (-0.22, 0.0, 0.22) for tilt in (0.44, 0.6, 0.76)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the butler with the camera of LENS, which has few pixels: soon computed."""
    folder = Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler"))
    file = folder / "robot.toml"
    own = load_robot("butler").camera
    text = file.read_text()
    for key, size in (("width", LENS.width), ("height", LENS.height)):
        before = f"{key} = {getattr(own, key)}\n"
        assert before in text
        text = text.replace(before, f"{key} = {size}\n")
    file.write_text(text)
    return folder


@pytest.fixture(scope="module")
def lens_images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    images = tmp_path_factory.mktemp("images") / "lens"
    put_images_for_the_lens(images)
    return images


@functools.cache
def lens_rays() -> Array:
    """Return four rays for each pixel of LENS."""
    fine = np.mgrid[0:320:0.5, 0:240:0.5].reshape(2, -1).T - 0.25
    return np.column_stack((rays_of(LENS, fine), np.ones(len(fine))))


def seen(camera_from_board: Array) -> NDArray[np.uint8]:
    """Return what LENS shows of the board."""
    board_from_camera = np.linalg.inv(camera_from_board)
    rays = lens_rays() @ board_from_camera[:3, :3].T
    at = rays[:, :2] * (-board_from_camera[2, 3] / rays[:, 2])[:, None] + board_from_camera[:2, 3]
    scale = PRINT.shape[1] / BOARD.image_size[0]
    x, y = ((at * BOARD.pixels_per_m + BOARD.margin_px) * scale - 0.5).T.reshape(2, 640, 480)
    columns, rows = x.T.astype(np.float32), y.T.astype(np.float32)
    fine_image = cv2.remap(PRINT, columns, rows, cv2.INTER_LINEAR, borderValue=128)
    image: NDArray[np.uint8] = cv2.resize(fine_image, (320, 240), interpolation=cv2.INTER_AREA)
    return image


def board_at(turn: tuple[float, float, float], at: tuple[float, float, float]) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(np.array(turn))[0]
    middle = np.array((BOARD.columns, BOARD.rows, 0.0)) * 0.5 * BOARD.square_m
    pose[:3, 3] = np.array(at) - pose[:3, :3] @ middle
    return pose


def put_images_for_the_lens(images: Path) -> None:
    images.mkdir()
    for number in range(12):
        turn = (0.4 * math.cos(number), 0.4 * math.sin(number), 0.1 * number)
        at = (0.19 * math.sin(2.4 * number), 0.13 * math.cos(2.4 * number), 0.55 + 0.01 * number)
        cv2.imwrite(str(images / f"{number:02d}.png"), seen(board_at(turn, at)))


def put_images_for_the_seat(images: Path, robot_folder: Path, seat: Array) -> None:
    images.mkdir()
    robot = load_robot(robot_folder)
    model, joints = RobotModel(robot), {}

    def site(pan: float, tilt: float) -> Array:
        named = [("head_pan", pan), ("head_tilt", tilt)]
        return model.site_pose(robot.camera.site, full_positions(robot, named))

    board = site(0.0, 0.6) @ seat @ board_at((0.15, 0.1, 0.05), (0.0, 0.0, 0.6))
    for number, (pan, tilt) in enumerate(HEAD):
        joints[f"{number}.png"] = {"head_pan": pan, "head_tilt": tilt}
        image = seen(np.linalg.inv(site(pan, tilt) @ seat) @ board)
        cv2.imwrite(str(images / f"{number}.png"), image)
    (images / "joints.json").write_text(json.dumps(joints))


def camera(*words: object) -> int:
    return main(["camera", *map(str, words), "--square-mm", "55"])


def test_lens_and_seat_are_measured_written_and_in_force(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    put_images_for_the_lens(tmp_path / "lens")
    assert camera("calibrate", "--robot", folder, "--images", tmp_path / "lens", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["error_px"] < 0.4
    assert load_robot(folder).camera.intrinsics.fx == pytest.approx(LENS.fx, rel=0.01)

    seat = np.eye(4)
    seat[:3, 3] = (0.005, -0.003, 0.009)
    put_images_for_the_seat(tmp_path / "seat", folder, seat)
    assert camera("hand-eye", "--robot", folder, "--images", tmp_path / "seat") == 0
    assert "restart the robot" in capsys.readouterr().out
    mounting = load_robot(folder).camera.mounting
    assert mounting is not None
    assert mounting.translation_m == pytest.approx((0.005, -0.003, 0.009), abs=0.003)

    assert camera("check", "--robot", folder, "--images", tmp_path / "seat", "--json") == 0
    checked = json.loads(capsys.readouterr().out)
    assert (checked["lens_ok"], checked["depth_ratio"]) == (True, None)


def test_a_camera_that_does_not_fit_its_calibration_any_more_fails_the_check(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Never calibrated: it is judged as the pinhole of the robot file.
    put_images_for_the_lens(tmp_path / "lens")
    assert camera("check", "--robot", folder, "--images", tmp_path / "lens") == 1
    assert "calibrate the lens" in capsys.readouterr().out


def test_nothing_is_written_for_images_of_nothing(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    for number in range(9):
        cv2.imwrite(str(tmp_path / "empty" / f"{number}.png"), np.full((240, 320), 90, np.uint8))
    assert camera("calibrate", "--robot", folder, "--images", tmp_path / "empty") == 2
    assert "0 usable views, expected 8" in capsys.readouterr().err
    assert not (folder / "camera.yaml").exists()
    assert camera("check", "--robot", folder, "--images", tmp_path / "empty") == 1
    assert camera("calibrate", "--robot", folder, "--images", tmp_path / "nowhere") == 2


@pytest.mark.parametrize("odd", [[0], [7], range(12)])
def test_images_of_another_size_are_refused_and_the_lens_before_stays(
    folder: Path,
    tmp_path: Path,
    lens_images: Path,
    capsys: pytest.CaptureFixture[str],
    odd: Iterable[int],
) -> None:
    shutil.copytree(lens_images, tmp_path / "lens")
    for number in odd:
        path = str(tmp_path / "lens" / f"{number:02d}.png")
        cv2.imwrite(path, cv2.resize(cv2.imread(path), (640, 480)))
    before = "image_width: 320\n"
    (folder.parent / "kept.yaml").write_text(before)
    words = ("--images", tmp_path / "lens", "--output", folder.parent / "kept.yaml")
    assert camera("calibrate", "--robot", folder, *words) == 2
    assert "got 640 x 480 px, expected 320 x 240" in capsys.readouterr().err
    assert (folder.parent / "kept.yaml").read_text() == before


def test_a_lens_that_the_robot_would_refuse_is_not_written(
    folder: Path, lens_images: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # The robot file tells of a camera that sees a third as much.
    file = folder / "robot.toml"
    text = file.read_text()
    fovy_rad = load_robot(folder).camera.fovy_rad
    assert f"fovy_rad = {fovy_rad}" in text
    file.write_text(text.replace(f"fovy_rad = {fovy_rad}", f"fovy_rad = {fovy_rad / 3:.3f}"))
    assert camera("calibrate", "--robot", folder, "--images", lens_images) == 2
    assert "camera.yaml: " in (told := capsys.readouterr().err)
    assert "as the robot file's fovy_rad has it" in told
    assert not (folder / "camera.yaml").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "cannot be read"),
        ("[]", "expected a table"),
        ('{"0.png": {"head_pan": "left"}}', "expected a joint of the robot"),
        ('{"0.png": {"tail": 0.1}}', "'tail'"),
        ('{"0.png": 3}', "expected a joint of the robot"),
        ("{}", "its joints are not known"),
    ],
)
def test_a_seat_without_sound_joints_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, told: str
) -> None:
    (tmp_path / "seat").mkdir()
    cv2.imwrite(str(tmp_path / "seat" / "0.png"), seen(board_at((0.1, 0, 0), (0, 0, 0.6))))
    (tmp_path / "seat" / "joints.json").write_text(text)
    assert camera("hand-eye", "--robot", folder, "--images", tmp_path / "seat") == 2
    assert told in capsys.readouterr().err


def test_a_board_is_written_with_how_to_print_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert camera("board", tmp_path / "board.pdf") == 0
    assert "385 x 275 mm" in capsys.readouterr().out
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    assert camera("board", tmp_path / "board.pdf", "--columns", "1") == 2
    assert camera("board", tmp_path / "none" / "board.pdf") == 2


def test_images_of_the_running_robot_are_taken_only_while_the_head_is_still(
    session, robot, clock
) -> None:
    butler = load_robot("butler")
    count = len(butler.joint_names)
    state, frames = robot.space.cell_writer("joint_state"), robot.space.frame_writer("rgbd")
    payload = np.full(320 * 240 * 5, 7, np.uint8).tobytes()
    tilt = butler.joint_index["head_tilt"]

    def live() -> None:
        positions = np.zeros(count)
        positions[tilt] = 0.4 * min(1.0, max(0.0, clock.now_s - 2.0))  # turns from 2 to 3 s
        zeros = np.zeros(count)
        state.put(
            joint_count=count, position=positions, velocity=zeros, setpoint=zeros,
            effort_ratio=zeros, age_s=zeros, error=zeros, torque_enabled=zeros,
        )  # fmt: skip
        frames.put(payload, width=320, height=240, stamp_ns=clock.now_ns() - 30_000_000)

    clock.after_wait = live
    shots = list(live_images(session, butler, seconds=4.0))
    tilts = {round(float(shot.positions[tilt]), 3) for shot in shots if shot.positions is not None}
    assert tilts == {0.0, 0.4}
    assert shots[0].rgb.shape == (240, 320, 3)
    assert shots[0].depth_m is not None
    assert shots[0].depth_m[0, 0] == pytest.approx(0x0707 * 0.001)
