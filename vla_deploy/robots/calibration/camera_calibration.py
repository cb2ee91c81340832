"""Keep what calibration has measured of the camera in files next to the robot file.

`camera.yaml` holds the lens in the format of ROS' camera_info, so that existing files do; without
it the camera's own intrinsics count. `camera_mounting.toml` holds by how much the camera sits
otherwise than the MJCF says; without it, it sits as drawn. Both name the camera they were measured
on, and a measurement of another one is refused.
"""

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import yaml

from drivers.camera.protocol import Intrinsics
from vla_deploy.robots.calibration.lens_schema import lens_faults
from vla_deploy.robots.calibration.replacing import replace_text
from vla_deploy.robots.camera import CameraDescription, CameraMounting, LensCalibration
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.runtime.one_line import one_line
from vla_deploy.runtime.table_schema import (
    NUMBER,
    TEXT,
    Shape,
    TableFault,
    build,
    check_record,
    numbers,
    parse_toml,
)

LENS_FILE: Final = "camera.yaml"
MOUNTING_FILE: Final = "camera_mounting.toml"
# A larger correction means another mount, or a mistake: the MJCF has to be corrected then.
MAX_SHIFT_M: Final = 0.05
MAX_TURN_RAD: Final = math.radians(12.0)
# A lens that was calibrated anew may move the mounting: it was measured through the old one.
SAME_FOCAL_RATIO: Final = 0.01
MODELS: Final[Mapping[str, tuple[int, ...]]] = {"plumb_bob": (4, 5), "rational_polynomial": (8,)}
"""ROS' names of the distortion models, and how many coefficients each has."""

Document = Mapping[str, Any]


MOUNTING: Shape = {
    "site": TEXT,
    "model": TEXT,
    "focal_px": NUMBER,
    "translation_m": numbers(3),
    "quaternion_xyzw": numbers(4),
    "residual_m": NUMBER,
    "made_at": TEXT,
}
MOUNTING_HEADER = """\
# Written by `vla-deploy camera hand-eye`: where the camera is in the frame of its site in the MJCF.
"""


def with_calibration(
    camera: CameraDescription, directory: Path
) -> tuple[CameraDescription, tuple[TableFault, ...]]:
    """Return a camera with the calibration files of its robot's folder, and their faults."""
    faults: list[TableFault] = []
    try:
        camera = replace(camera, lens=read_lens(directory / LENS_FILE, camera))
    except RobotFileError as error:
        faults += _with_file_name(LENS_FILE, error)
    try:
        # Judged with the lens in force: through another one it was measured differently.
        camera = replace(camera, mounting=read_mounting(directory / MOUNTING_FILE, camera))
    except RobotFileError as error:
        faults += _with_file_name(MOUNTING_FILE, error)
    return camera, tuple(faults)


def read_lens(file: Path, camera: CameraDescription) -> LensCalibration | None:
    """Return the lens of a camera_info file; None where there is no file.

    Raises:
        RobotFileError: the file cannot be used for this camera; all its faults are listed.
    """
    text = _text(file)
    if text is None:
        return None
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise _unreadable(file, one_line(error), "a YAML document") from error
    except RecursionError:
        raise _unreadable(file, "one that is nested too deeply", "a YAML document") from None
    if not isinstance(document, dict):
        raise _unreadable(file, type(document).__name__, "the tables of ROS' camera_info")
    faults = tuple(lens_faults(document, camera, MODELS))
    if faults:
        raise RobotFileError(file, faults)
    return _lens(document)


def write_lens(file: Path, lens: LensCalibration, camera: CameraDescription) -> None:
    """Replace the file in one act; the one before stays as `<file>.bak`.

    Raises:
        RobotFileError: reading would refuse it, which keeps the robot from loading, or it cannot be
            written; the old file stays.
    """
    at = lens.intrinsics
    document = {
        "image_width": at.width,
        "image_height": at.height,
        "camera_name": camera.site,
        "camera_model": camera.model,
        "camera_matrix": _matrix(3, 3, [at.fx, 0.0, at.cx, 0.0, at.fy, at.cy, 0.0, 0.0, 1.0]),
        "distortion_model": lens.distortion_model,
        "distortion_coefficients": _matrix(1, len(at.distortion), list(at.distortion)),
        "rectification_matrix": _matrix(3, 3, np.eye(3).ravel().tolist()),
        "projection_matrix": _matrix(
            3, 4, [at.fx, 0.0, at.cx, 0.0, 0.0, at.fy, at.cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        ),
        "reprojection_error_px": lens.reprojection_error_px,
        "views": lens.views,
        "made_at": lens.made_at,
        "tool": lens.tool,
    }
    faults = tuple(lens_faults(document, camera, MODELS))
    if faults:
        raise RobotFileError(file, faults)
    replace_text(file, yaml.safe_dump(document, sort_keys=False, default_flow_style=None))


def read_mounting(file: Path, camera: CameraDescription) -> CameraMounting | None:
    """Return the correction of the camera's place; None where there is no file.

    Raises:
        RobotFileError: the file cannot be used for this camera; all its faults are listed.
    """
    text = _text(file)
    if text is None:
        return None
    try:
        document = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise _unreadable(file, str(error), "a TOML document") from error
    faults = tuple(check_record(document, "", MOUNTING)) or tuple(_wrong(document, camera))
    if faults:
        raise RobotFileError(file, faults)
    return build(CameraMounting, document)


def require_plausible(file: Path, mounting: CameraMounting, camera: CameraDescription) -> None:
    """Check a mounting before it is written, as it will be checked when it is read.

    Raises:
        RobotFileError: it moves or turns the camera further than any mounting does.
    """
    faults = tuple(_wrong(asdict(mounting), camera))
    if faults:
        raise RobotFileError(file, faults)


def write_mounting(file: Path, mounting: CameraMounting) -> None:
    """Replace the file in one act; the one before stays as `<file>.bak`.

    Raises:
        RobotFileError: it cannot be written; the old file stays.
    """
    rows = (f"{key} = {json.dumps(value)}\n" for key, value in asdict(mounting).items())
    replace_text(file, MOUNTING_HEADER + "".join(rows))


def _wrong(document: Document, camera: CameraDescription) -> Iterator[TableFault]:
    for key in ("site", "model"):
        if document[key] != (expected := getattr(camera, key)):
            wanted = f"{expected!r}, as in the robot file: measure this camera's mounting again"
            yield TableFault(key=key, got=repr(document[key]), expected=wanted)
    length = float(np.linalg.norm(document["quaternion_xyzw"]))
    if abs(length - 1.0) > 1e-3:
        yield TableFault(
            key="quaternion_xyzw",
            got=f"one of length {length:.4g}",
            expected="a rotation: length 1",
        )
    shift_m = float(np.linalg.norm(document["translation_m"]))
    if shift_m > MAX_SHIFT_M:
        wanted = f"at most {MAX_SHIFT_M} m; correct the site in the MJCF if it sits there"
        yield TableFault(key="translation_m", got=f"{shift_m:.3f} m", expected=wanted)
    turn_rad = 2.0 * math.acos(min(1.0, abs(document["quaternion_xyzw"][3])))
    if turn_rad > MAX_TURN_RAD:
        wanted = f"at most {math.degrees(MAX_TURN_RAD):.0f} degrees; correct the site in the MJCF"
        yield TableFault(
            key="quaternion_xyzw", got=f"{math.degrees(turn_rad):.1f}", expected=wanted
        )
    focal_px = camera.intrinsics.fx
    if abs(document["focal_px"] / focal_px - 1.0) > SAME_FOCAL_RATIO:
        wanted = f"{focal_px:.1f}, the lens in force: run `vla-deploy camera hand-eye` again"
        yield TableFault(key="focal_px", got=repr(document["focal_px"]), expected=wanted)


def _lens(document: Document) -> LensCalibration:
    matrix = [float(value) for value in document["camera_matrix"]["data"]]
    coefficients = tuple(float(value) for value in document["distortion_coefficients"]["data"])
    return LensCalibration(
        intrinsics=Intrinsics(
            width=document["image_width"],
            height=document["image_height"],
            fx=matrix[0],
            fy=matrix[4],
            cx=matrix[2],
            cy=matrix[5],
            distortion=coefficients if any(coefficients) else (),
        ),
        distortion_model=document["distortion_model"],
        reprojection_error_px=document.get("reprojection_error_px"),
        views=document.get("views"),
        made_at=document.get("made_at", ""),
        tool=document.get("tool", ""),
    )


def _matrix(rows: int, columns: int, data: list[float]) -> dict[str, Any]:
    return {"rows": rows, "cols": columns, "data": [round(float(value), 9) for value in data]}


def _text(file: Path) -> str | None:
    try:
        return file.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError) as error:
        raise _unreadable(file, str(error), "a text file that can be read") from error


def _with_file_name(file: str, error: RobotFileError) -> list[TableFault]:
    return [replace(fault, key=f"{file}: {fault.key}") for fault in error.faults]


def _unreadable(file: Path, got: str, expected: str) -> RobotFileError:
    return RobotFileError(file, (TableFault(key="(file)", got=got, expected=expected),))
