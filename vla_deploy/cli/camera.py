"""`vla-deploy camera ...`: print a board, calibrate lens and mounting, check them."""

import argparse
import dataclasses
import json
import math
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from vla_deploy.cli.camera_images import (
    Shot,
    add_board_arguments,
    add_image_arguments,
    board_of,
    require_size,
    shots_of,
)
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_command, add_top_command
from vla_deploy.perception.camera_tools.board import BoardView, write_board
from vla_deploy.perception.camera_tools.board_pose import board_pose, depth_ratio
from vla_deploy.perception.camera_tools.hand_eye import HandEye, HeadView, fit_hand_eye
from vla_deploy.perception.camera_tools.lens_fit import MODELS, LensFit, fit_lens
from vla_deploy.perception.camera_tools.selecting import ViewSelection, select
from vla_deploy.perception.geometry.rotation import angle_rad
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.calibration.camera_calibration import (
    LENS_FILE,
    MOUNTING_FILE,
    require_plausible,
    write_lens,
    write_mounting,
)
from vla_deploy.robots.description import CameraMounting, LensCalibration
from vla_deploy.robots.kinematics.model import RobotModel

TOOL: Final = "vla-deploy camera calibrate"
CHECK_ERROR_PX: Final = 0.8
CHECK_DEPTH_RATIO: Final = 0.02
_MM: Final = 1000.0


def register(commands: Any) -> None:
    """Add the group of commands."""
    camera = add_top_command(
        commands,
        "camera",
        "  vla-deploy camera board board.pdf\n"
        "  vla-deploy camera calibrate --robot butler --square-mm 35.8\n"
        "  vla-deploy camera hand-eye --robot butler --square-mm 35.8\n"
        "  vla-deploy camera check --robot butler --square-mm 35.8\n",
    )
    acts = camera.add_subparsers(dest="camera_command", required=True, metavar="CAMERA_COMMAND")
    board = add_command(
        acts,
        "board",
        "write a board to print in its true size, as PDF or PNG",
        "  vla-deploy camera board board.pdf\n"
        "  vla-deploy camera board board.pdf --columns 8 --rows 6 --square-mm 45\n",
    )
    board.add_argument("file", type=Path, help="ends in .pdf or .png")
    add_board_arguments(board)
    board.set_defaults(run=draw)
    calibrated = _add_act(acts, "calibrate", "measure the lens, and write it", calibrate)
    calibrated.add_argument(
        "--model", choices=MODELS, default="plumb_bob", help="of distortion (default: plumb_bob)"
    )
    mounted = _add_act(acts, "hand-eye", "measure how the camera sits on the head", hand_eye)
    for act in (calibrated, mounted):
        act.add_argument(
            "--output", type=Path, metavar="FILE", help="write here (default: at the robot file)"
        )
    checked = _add_act(acts, "check", "say whether lens and depth still fit", check)
    for act, views in ((calibrated, 16), (mounted, 16), (checked, 5)):
        told = f"to use at most (default: {views})"
        act.add_argument("--views", type=int, default=views, help=told)


def _add_act(
    acts: Any, name: str, summary: str, run: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    example = (
        f"  vla-deploy camera {name} --robot butler --square-mm 35.8\n"
        f"  vla-deploy camera {name} --robot butler --images photos --json\n"
    )
    act = add_command(acts, name, summary, example)
    add_image_arguments(act)
    act.set_defaults(run=run)
    return act


def draw(arguments: argparse.Namespace) -> int:
    """Write the board."""
    board = board_of(arguments)
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
    """Measure the lens and write it beside the robot file."""
    robot = load_robot(arguments.robot)
    shots, chosen = _chosen(arguments, robot)
    if not shots:
        raise CommandFailed("no image came; is the camera at work? see: vla-deploy status")
    fit = fit_lens(chosen.views, (robot.camera.width, robot.camera.height), arguments.model)
    file = arguments.output or robot.mjcf_path.parent / LENS_FILE
    write_lens(file, _as_lens(fit), robot.camera)
    report = {**dataclasses.asdict(fit), "left_out": chosen.left_out, "file": str(file)}
    at = fit.intrinsics
    text = (
        f"f {at.fx:.1f}, {at.fy:.1f} px, middle {at.cx:.1f}, {at.cy:.1f} px; error "
        f"{fit.error_px:.2f} px over {len(fit.view_errors_px)} views\n"
        f"{_by_view(fit.view_errors_px)}\nwritten to {file}; restart the robot, then measure how "
        "the camera sits: vla-deploy camera hand-eye"
    )
    return _tell(arguments, report, text)


def hand_eye(arguments: argparse.Namespace) -> int:
    """Measure the camera's place on its site and write it beside the robot file."""
    robot = load_robot(arguments.robot)
    shots, chosen = _chosen(arguments, robot)
    views = _head_views(robot, shots, chosen.views)
    found = fit_hand_eye(views, robot.camera.intrinsics)
    file = arguments.output or robot.mjcf_path.parent / MOUNTING_FILE
    mounting = _as_mounting(found, robot)
    require_plausible(file, mounting, robot.camera)
    write_mounting(file, mounting)
    report = {
        **dataclasses.asdict(mounting),
        "error_px": found.error_px,
        "view_errors_px": found.view_errors_px,
        "shift_sigma_m": found.shift_sigma_m,
        "turn_sigma_rad": found.turn_sigma_rad,
        "left_out": chosen.left_out,
        "file": str(file),
    }
    shift = ", ".join(f"{_MM * value:+.1f}" for value in mounting.translation_m)
    text = (
        f"the camera sits {shift} mm (right, down, ahead) and {_turn_deg(found):.2f} degrees from "
        f"where it is drawn, known to {_MM * found.shift_sigma_m:.1f} mm; error "
        f"{found.error_px:.2f} px\n{_by_view(found.view_errors_px)}\n"
        f"written to {file}; restart the robot"
    )
    return _tell(arguments, report, text)


def check(arguments: argparse.Namespace) -> int:
    """Compare views of a board with what the calibration expects; return 1 where one is off."""
    robot = load_robot(arguments.robot)
    shots, chosen = _chosen(arguments, robot)
    if not chosen.views:
        raise CommandFailed("the board was not seen; hold it nearer, flat and in good light")
    poses = {view.name: board_pose(view, robot.camera.intrinsics) for view in chosen.views}
    errors_px = {name: round(pose.error_px, 3) for name, pose in poses.items()}
    ratios = [
        ratio
        for view in chosen.views
        if (depth_m := shots[view.name].depth_m) is not None
        and (ratio := depth_ratio(view, poses[view.name], depth_m)) is not None
    ]
    ratio = float(np.median(ratios)) if ratios else None
    lens_ok = max(errors_px.values()) <= CHECK_ERROR_PX
    depth_ok = ratio is None or abs(ratio - 1.0) <= CHECK_DEPTH_RATIO
    report = {
        "view_errors_px": errors_px,
        "lens_ok": lens_ok,
        "depth_ratio": ratio,
        "depth_ok": depth_ok,
        "left_out": chosen.left_out,
    }
    _tell(arguments, report, _check_text(errors_px, lens_ok, ratio, depth_ok))
    return 0 if lens_ok and depth_ok else 1


def _check_text(
    errors_px: dict[str, float], lens_ok: bool, ratio: float | None, depth_ok: bool
) -> str:
    lens = "the lens fits" if lens_ok else "calibrate the lens: vla-deploy camera calibrate"
    depth = "no depth at the board" if ratio is None else f"depth {100 * (ratio - 1):+.1f} %"
    if not depth_ok:
        depth += ": it does not fit the lens, see the camera's own calibration of depth"
    return f"{_by_view(errors_px)}\n{lens}\n{depth}"


def _chosen(
    arguments: argparse.Namespace, robot: RobotDescription
) -> tuple[dict[str, Shot], ViewSelection]:
    """Return the images taken, by name, and the views that are of use."""
    shots: dict[str, Shot] = {}

    def images() -> Any:
        for shot in shots_of(arguments, robot):
            require_size(shot, robot.camera)
            shots[shot.name] = shot
            yield shot.name, shot.rgb

    def tell(view: BoardView) -> None:
        print(f"{view.name}: {len(view.pixels)} corners", file=sys.stderr)

    return shots, select(images(), board_of(arguments), enough=arguments.views, tell=tell)


def _head_views(
    robot: RobotDescription, shots: dict[str, Shot], views: tuple[BoardView, ...]
) -> list[HeadView]:
    model, found = RobotModel(robot), []
    for view in views:
        positions = shots[view.name].positions
        if positions is None:
            raise UsageError(
                f"{view.name}: its joints are not known; put them into joints.json: "
                '{"%s": {"head_pan": 0.1, "head_tilt": 0.4}}' % view.name
            )
        site = model.site_pose(robot.camera.site, positions)
        found.append(HeadView(view=view, base_from_site=site))
    return found


def _as_lens(fit: LensFit) -> LensCalibration:
    return LensCalibration(
        intrinsics=fit.intrinsics,
        distortion_model=fit.distortion_model,
        reprojection_error_px=round(fit.error_px, 4),
        views=len(fit.view_errors_px),
        made_at=_now(),
        tool=TOOL,
    )


def _as_mounting(found: HandEye, robot: RobotDescription) -> CameraMounting:
    x, y, z = (round(float(value), 6) for value in found.site_from_camera[:3, 3])
    return CameraMounting(
        site=robot.camera.site,
        model=robot.camera.model,
        focal_px=robot.camera.intrinsics.fx,
        translation_m=(x, y, z),
        quaternion_xyzw=found.quaternion_xyzw(),
        residual_m=round(found.residual_m, 6),
        made_at=_now(),
    )


def _turn_deg(found: HandEye) -> float:
    return math.degrees(angle_rad(found.site_from_camera[:3, :3]))


def _by_view(errors_px: dict[str, float]) -> str:
    return "\n".join(f"  {name}: {error:.2f} px" for name, error in errors_px.items())


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _tell(arguments: argparse.Namespace, report: dict[str, Any], text: str) -> int:
    print(json.dumps(report, indent=2) if arguments.json else text)
    return 0
