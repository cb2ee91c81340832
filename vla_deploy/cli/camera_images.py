"""Give images of the board: from a folder, or from the camera of the robot that runs."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import Session, attach
from vla_deploy.ipc.rgbd_image import colours, depths_m
from vla_deploy.model_tools.detectors.images import image_paths, read_image
from vla_deploy.perception.camera_tools.board import CalibrationBoard, Image
from vla_deploy.perception.objects.history import JointHistory
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import CameraDescription
from vla_deploy.robots.kinematics.model import full_positions
from vla_deploy.robots.schema import is_number

Array = NDArray[np.float64]
JOINTS_FILE: Final = "joints.json"
# A head that turns or shakes gives images of no known pose.
STILL_RAD: Final = 0.002
STILL_NS: Final = NS_PER_S // 4
JOINTS_GAP_NS: Final = NS_PER_S // 10
IMAGE_AGE_S: Final = 2.0
_WAIT_S: Final = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Shot:
    """Hold one image; joints (robot file's order) and depth where they are known."""

    name: str
    rgb: Image
    positions: Array | None = None
    depth_m: NDArray[np.float32] | None = None


def add_image_arguments(act: argparse.ArgumentParser) -> None:
    """Add what says where images come from and what board they show."""
    act.add_argument("--robot", default="butler", help="name or folder of a robot")
    act.add_argument(
        "--images", type=Path, metavar="DIR", help="a folder (default: the robot that runs)"
    )
    act.add_argument("--seconds", type=float, default=120.0, help="to look at most (default: 120)")
    add_board_arguments(act)
    act.add_argument("--json", action="store_true", help="print JSON")


def add_board_arguments(act: argparse.ArgumentParser) -> None:
    """Add what describes the board."""
    plain = CalibrationBoard()
    act.add_argument("--columns", type=int, default=plain.columns, help="squares across")
    act.add_argument("--rows", type=int, default=plain.rows, help="squares down")
    act.add_argument(
        "--square-mm",
        type=float,
        default=1000 * plain.square_m,
        help=f"width of a square, as measured on the print (default: {1000 * plain.square_m:g})",
    )


def board_of(arguments: argparse.Namespace) -> CalibrationBoard:
    """Return the board that the arguments describe.

    Raises:
        UsageError: there is no such board.
    """
    try:
        return CalibrationBoard(
            columns=arguments.columns, rows=arguments.rows, square_m=arguments.square_mm / 1000
        )
    except ValueError as error:
        raise UsageError(str(error)) from error


def require_size(shot: Shot, camera: CameraDescription) -> None:
    """Accept an image of the camera's size.

    Raises:
        UsageError: it is of another: the lens in force is one for the robot file's size only.
    """
    height, width = shot.rgb.shape[:2]
    if (width, height) != (camera.width, camera.height):
        raise UsageError(
            f"{shot.name}: got {width} x {height} px, expected {camera.width} x {camera.height}, "
            "the camera's in the robot file; take images at that size, do not scale them"
        )


def shots_of(arguments: argparse.Namespace, robot: RobotDescription) -> Iterator[Shot]:
    """Yield the images that the arguments name.

    Raises:
        UsageError: no robot runs, or a folder's joints cannot be read.
        ImagesInvalid: the folder holds no image, or one that cannot be read.
    """
    if arguments.images is not None:
        return from_folder(arguments.images, robot)
    return from_robot(attach(arguments.runtime_base), robot, arguments.seconds)


def from_folder(folder: Path, robot: RobotDescription) -> Iterator[Shot]:
    """Yield the images of a folder; `joints.json` gives joints by image name.

    Raises:
        UsageError: the joints cannot be read.
        ImagesInvalid: the folder holds no image, or one that cannot be read.
    """
    joints = _joints_of(folder, robot)
    for path in image_paths(folder):
        name = path.relative_to(folder).as_posix()
        yield Shot(name=name, rgb=read_image(path), positions=joints.get(name))


def from_robot(session: Session, robot: RobotDescription, seconds: float) -> Iterator[Shot]:
    """Yield the running robot's images for some time, those taken while its head was still."""
    joints, seen = JointHistory(), -1
    end_ns = session.clock.now_ns() + round(seconds * NS_PER_S)
    while session.clock.now_ns() < end_ns:
        state = session.fresh("joint_state")
        if state is not None:
            count = len(robot.joint_names)
            joints.add(state.stamp_ns, np.array(state.data["position"][:count], dtype=np.float64))
        frame = session.frame("rgbd", IMAGE_AGE_S)
        if frame is not None and frame.sequence != seen:
            seen = frame.sequence
            positions = _still_positions(joints, frame.stamp_ns)
            if positions is not None:
                yield Shot(
                    name=f"image {seen}",
                    rgb=colours(frame),
                    positions=positions,
                    depth_m=depths_m(frame),
                )
        session.pause(_WAIT_S)


def _still_positions(joints: JointHistory, stamp_ns: int) -> Array | None:
    """Return the joints at an image's time, None where they moved before it or are not known."""
    now = joints.at(stamp_ns, JOINTS_GAP_NS)
    before = joints.at(stamp_ns - STILL_NS, JOINTS_GAP_NS)
    if now is None or before is None or float(np.abs(now - before).max()) > STILL_RAD:
        return None
    return now


def _joints_of(folder: Path, robot: RobotDescription) -> dict[str, Array]:
    file = folder / JOINTS_FILE
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise UsageError(f"{file}: cannot be read: {error}") from error
    if not isinstance(document, dict):
        raise UsageError(f"{file}: expected a table of image names, got {type(document).__name__}")
    return {name: _positions(file, name, row, robot) for name, row in document.items()}


def _positions(file: Path, name: str, row: object, robot: RobotDescription) -> Array:
    known = robot.joint_index
    named: dict[Any, Any] = row if isinstance(row, dict) else {"": row}
    for joint, value in named.items():
        if joint not in known or not is_number(value):
            raise UsageError(
                f"{file}: {name}: got {joint!r} = {value!r}, expected a joint of the robot and its "
                f"position, such as head_pan = 0.1"
            )
    return full_positions(robot, [(joint, float(value)) for joint, value in named.items()])
