"""`vla-deploy camera ...`: print a board, calibrate lens and mounting, check them."""

import argparse
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.commands import Run, add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import attach
from vla_deploy.model_tools.detectors.labelled import image_paths, read_image
from vla_deploy.perception.camera_tools.board import BoardView, CalibrationBoard, Image, write_board
from vla_deploy.perception.camera_tools.board_pose import CameraCheck, check_camera
from vla_deploy.perception.camera_tools.hand_eye import HeadView, fit_hand_eye
from vla_deploy.perception.camera_tools.head_images import (
    HeadImage,
    joints_by_image,
    live_images,
)
from vla_deploy.perception.camera_tools.lens_fit import MODELS, fit_lens
from vla_deploy.perception.camera_tools.selecting import ViewSelection, select
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.calibration.camera_calibration import (
    LENS_FILE,
    MOUNTING_FILE,
    require_plausible,
    write_lens,
    write_mounting,
)
from vla_deploy.robots.kinematics.model import RobotModel

TOOL: Final = "vla-deploy camera calibrate"
_MM: Final = 1000.0
_EXAMPLES: Final = """  vla-deploy camera board board.pdf
  vla-deploy camera calibrate --robot butler --square-mm 35.8
  vla-deploy camera hand-eye --robot butler --square-mm 35.8
  vla-deploy camera check --robot butler --square-mm 35.8
"""
_BOARD_EXAMPLES: Final = """  vla-deploy camera board board.pdf
  vla-deploy camera board board.pdf --columns 8 --rows 6 --square-mm 45
"""


def register(commands: Any) -> None:
    """Add the group of commands."""
    acts = add_top_command(commands, "camera", _EXAMPLES).add_subparsers(
        dest="camera_command", required=True, metavar="CAMERA_COMMAND"
    )
    summary = "write a board to print in its true size, as PDF or PNG"
    board = add_command(acts, "board", summary, _BOARD_EXAMPLES, draw)
    board.add_argument("file", type=Path, help="ends in .pdf or .png")
    _add_board_arguments(board)
    calibrated = _add_act(acts, "calibrate", "measure the lens, and write it", calibrate, 16)
    mounted = _add_act(acts, "hand-eye", "measure how the camera sits on the head", hand_eye, 16)
    _add_act(acts, "check", "check whether lens and depth still fit", check, 5)
    calibrated.add_argument(
        "--model", choices=MODELS, default="plumb_bob", help="of distortion (default: plumb_bob)"
    )
    for act in (calibrated, mounted):
        act.add_argument(
            "--output", type=Path, metavar="FILE", help="write here (default: at the robot file)"
        )


def _add_act(acts: Any, name: str, summary: str, run: Run, views: int) -> argparse.ArgumentParser:
    example = (
        f"  vla-deploy camera {name} --robot butler --square-mm 35.8\n"
        f"  vla-deploy camera {name} --robot butler --images photos --json\n"
    )
    act = add_command(acts, name, summary, example, run, json_help="print JSON")
    act.add_argument("--robot", default="butler", help="name or folder of a robot")
    act.add_argument(
        "--images", type=Path, metavar="DIR", help="a folder (default: the robot that runs)"
    )
    act.add_argument(
        "--seconds", type=float, default=120.0, help="time limit for images (default: 120)"
    )
    act.add_argument("--views", type=int, default=views, help=f"to use at most (default: {views})")
    _add_board_arguments(act)
    return act


def _add_board_arguments(act: argparse.ArgumentParser) -> None:
    default = CalibrationBoard()
    act.add_argument("--columns", type=int, default=default.columns, help="squares across")
    act.add_argument("--rows", type=int, default=default.rows, help="squares down")
    act.add_argument(
        "--square-mm",
        type=float,
        default=_MM * default.square_m,
        help=f"width of a square, as measured on the print (default: {_MM * default.square_m:g})",
    )


def draw(arguments: argparse.Namespace) -> int:
    """Write the board."""
    board = _board(arguments)
    try:
        write_board(arguments.file, board)
    except OSError as error:
        raise UsageError(f"{arguments.file}: cannot be written: {error.strerror}") from error
    width, height = (_MM * board.square_m * count for count in (board.columns, board.rows))
    print(
        f"{arguments.file}: {width:g} x {height:g} mm without its margin; print it unscaled, glue "
        "it onto something flat, measure a square and give its width by --square-mm"
    )
    return 0


def calibrate(arguments: argparse.Namespace) -> int:
    """Measure the lens and write it next to the robot file."""
    robot = load_robot(arguments.robot)
    images, chosen = _chosen_views(arguments, robot)
    if not images:
        raise CommandFailed("no image came; is the camera at work? see: vla-deploy status")
    fit = fit_lens(chosen.views, (robot.camera.width, robot.camera.height), arguments.model)
    file = arguments.output or robot.folder / LENS_FILE
    write_lens(file, fit.calibration(TOOL, _now()), robot.camera)
    at = fit.intrinsics
    text = (
        f"f {at.fx:.1f}, {at.fy:.1f} px, middle {at.cx:.1f}, {at.cy:.1f} px; error "
        f"{fit.error_px:.2f} px over {len(fit.view_errors_px)} views\n"
        f"{_by_view(fit.view_errors_px)}\nwritten to {file}; restart the robot, then measure how "
        "the camera sits: vla-deploy camera hand-eye"
    )
    return emit(arguments, {**asdict(fit), "left_out": chosen.left_out, "file": str(file)}, text)


def hand_eye(arguments: argparse.Namespace) -> int:
    """Measure the camera's place on its site and write it next to the robot file."""
    robot = load_robot(arguments.robot)
    images, chosen = _chosen_views(arguments, robot)
    found = fit_hand_eye(_head_views(robot, images, chosen.views), robot.camera.intrinsics)
    file = arguments.output or robot.folder / MOUNTING_FILE
    mounting = found.mounting(robot.camera, _now())
    require_plausible(file, mounting, robot.camera)
    write_mounting(file, mounting)
    report = {
        **asdict(mounting),
        "error_px": found.error_px,
        "view_errors_px": found.view_errors_px,
        "shift_sigma_m": found.shift_sigma_m,
        "turn_sigma_rad": found.turn_sigma_rad,
        "left_out": chosen.left_out,
        "file": str(file),
    }
    shift = ", ".join(f"{_MM * value:+.1f}" for value in mounting.translation_m)
    text = (
        f"the camera sits {shift} mm (right, down, ahead) and "
        f"{math.degrees(found.turn_rad()):.2f} degrees from where it is drawn, known to "
        f"{_MM * found.shift_sigma_m:.1f} mm; error {found.error_px:.2f} px\n"
        f"{_by_view(found.view_errors_px)}\nwritten to {file}; restart the robot"
    )
    return emit(arguments, report, text)


def check(arguments: argparse.Namespace) -> int:
    """Compare views of a board with what the calibration expects; return 1 where one is off."""
    robot = load_robot(arguments.robot)
    images, chosen = _chosen_views(arguments, robot)
    if not chosen.views:
        raise CommandFailed("the board was not seen; hold it nearer, flat and in good light")
    depths_m = {name: one.depth_m for name, one in images.items() if one.depth_m is not None}
    checked = check_camera(chosen.views, depths_m, robot.camera.intrinsics)
    report = {
        "view_errors_px": checked.view_errors_px,
        "lens_ok": checked.lens_ok,
        "depth_ratio": checked.depth_ratio,
        "depth_ok": checked.depth_ok,
        "left_out": chosen.left_out,
    }
    emit(arguments, report, _check_text(checked))
    return 0 if checked.lens_ok and checked.depth_ok else 1


def _check_text(checked: CameraCheck) -> str:
    ratio = checked.depth_ratio
    lens = "the lens fits" if checked.lens_ok else "calibrate the lens: vla-deploy camera calibrate"
    depth = "no depth at the board" if ratio is None else f"depth {100 * (ratio - 1):+.1f} %"
    if not checked.depth_ok:
        depth += ": it does not fit the lens, see the camera's own calibration of depth"
    return f"{_by_view(checked.view_errors_px)}\n{lens}\n{depth}"


def _chosen_views(
    arguments: argparse.Namespace, robot: RobotDescription
) -> tuple[dict[str, HeadImage], ViewSelection]:
    """Return the images by name, and the views that are of use."""
    images: dict[str, HeadImage] = {}

    def named() -> Iterator[tuple[str, Image]]:
        for image in _images(arguments, robot):
            image.require_size(robot.camera)
            images[image.name] = image
            yield image.name, image.rgb

    def print_view(view: BoardView) -> None:
        print(f"{view.name}: {len(view.pixels)} corners", file=sys.stderr)

    chosen = select(named(), _board(arguments), enough=arguments.views, on_view=print_view)
    return images, chosen


def _images(arguments: argparse.Namespace, robot: RobotDescription) -> Iterator[HeadImage]:
    folder = arguments.images
    if folder is None:
        yield from live_images(attach(arguments.runtime_base), robot, arguments.seconds)
        return
    joints = joints_by_image(folder, robot)
    for path in image_paths(folder):
        name = path.relative_to(folder).as_posix()
        yield HeadImage(name=name, rgb=read_image(path), positions=joints.get(name))


def _board(arguments: argparse.Namespace) -> CalibrationBoard:
    try:
        return CalibrationBoard(
            columns=arguments.columns, rows=arguments.rows, square_m=arguments.square_mm / _MM
        )
    except ValueError as error:
        raise UsageError(str(error)) from error


def _head_views(
    robot: RobotDescription, images: Mapping[str, HeadImage], views: tuple[BoardView, ...]
) -> list[HeadView]:
    model, found = RobotModel(robot), []
    for view in views:
        positions = images[view.name].positions
        if positions is None:
            raise UsageError(
                f"{view.name}: its joints are not known; put them into joints.json: "
                '{"%s": {"head_pan": 0.1, "head_tilt": 0.4}}' % view.name
            )
        site = model.site_pose(robot.camera.site, positions)
        found.append(HeadView(view=view, base_from_site=site))
    return found


def _by_view(errors_px: Mapping[str, float]) -> str:
    return "\n".join(f"  {name}: {error:.2f} px" for name, error in errors_px.items())


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
