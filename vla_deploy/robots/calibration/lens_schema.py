"""Find what is wrong with a camera_info file: its tables, its numbers, and the camera it is of."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from vla_deploy.robots.camera import CameraDescription
from vla_deploy.runtime.table_schema import TableFault, is_number

Document = Mapping[str, Any]
Models = Mapping[str, tuple[int, ...]]

# Beyond this no lens of the robot file's opening angle is, whatever its make.
FOCAL_RATIO: Final = (0.7, 1.4)
SQUARE_RATIO: Final = (0.8, 1.25)
MIDDLE_RATIO: Final = (0.3, 0.7)
_RADII: Final = 64


def lens_faults(
    document: Document, camera: CameraDescription, models: Models
) -> Iterator[TableFault]:
    """Yield every fault of a camera_info document, held against the robot file's camera."""
    yield from _of_another_camera(document, camera)
    sound = True
    for fault in (*_size_faults(document, camera), *_matrix_faults(document, camera)):
        sound = False
        yield fault
    for fault in _distortion_faults(document, models):
        sound = False
        yield fault
    yield from _rectification_faults(document)
    if sound:
        yield from _folds(document, camera)


def _of_another_camera(document: Document, camera: CameraDescription) -> Iterator[TableFault]:
    """Only files of our own tool name the model; those of other tools say nothing of it."""
    model = document.get("camera_model", camera.model)
    if model != camera.model:
        expected = f"{camera.model!r}, as in the robot file: calibrate this camera"
        yield TableFault(key="camera_model", got=repr(model), expected=expected)


def _size_faults(document: Document, camera: CameraDescription) -> Iterator[TableFault]:
    for key, expected in (("image_width", camera.width), ("image_height", camera.height)):
        if (got := document.get(key)) != expected:
            wanted = f"{expected}, the camera's in the robot file: calibrate at that resolution"
            yield TableFault(key=key, got=repr(got), expected=wanted)


def _matrix_faults(document: Document, camera: CameraDescription) -> Iterator[TableFault]:
    key = "camera_matrix.data"
    data = _data(document, "camera_matrix")
    if data is None or len(data) != 9:
        yield TableFault(
            key=key, got=repr(document.get("camera_matrix")), expected="9 finite numbers"
        )
        return
    fx, skew, cx, below, fy, cy, *last = data
    if (skew, below, last) != (0.0, 0.0, [0.0, 0.0, 1.0]):
        yield TableFault(key=key, got=repr(data), expected="fx 0 cx, 0 fy cy, 0 0 1")
    low, high = (ratio * camera.focal_px for ratio in FOCAL_RATIO)
    for name, focal in (("fx", fx), ("fy", fy)):
        if not low <= focal <= high:
            expected = f"{low:.0f}..{high:.0f} px, as the robot file's fovy_rad has it"
            yield TableFault(key=f"{key} {name}", got=f"{focal:g}", expected=expected)
    if fy > 0.0 and not SQUARE_RATIO[0] <= fx / fy <= SQUARE_RATIO[1]:
        expected = "nearly square pixels: fx / fy about 1"
        yield TableFault(key=key, got=f"fx / fy = {fx / fy:.3g}", expected=expected)
    for name, middle, size in (("cx", cx, camera.width), ("cy", cy, camera.height)):
        low, high = (ratio * size for ratio in MIDDLE_RATIO)
        if not low <= middle <= high:
            expected = f"{low:.0f}..{high:.0f} px, near the image's middle"
            yield TableFault(key=f"{key} {name}", got=f"{middle:g}", expected=expected)


def _distortion_faults(document: Document, models: Models) -> Iterator[TableFault]:
    model = document.get("distortion_model")
    if not isinstance(model, str) or model not in models:
        expected = f"one of {', '.join(models)}; others, such as fisheye lenses, are not supported"
        yield TableFault(key="distortion_model", got=repr(model), expected=expected)
        return
    data = _data(document, "distortion_coefficients")
    if data is None or len(data) not in models[model]:
        counts = " or ".join(map(str, models[model]))
        yield TableFault(
            key="distortion_coefficients.data",
            got=repr(document.get("distortion_coefficients")),
            expected=f"{counts} finite numbers for {model}",
        )


def _rectification_faults(document: Document) -> Iterator[TableFault]:
    """A rectified pair turns its images; this robot takes them as they are."""
    if "rectification_matrix" not in document:
        return
    data, key = _data(document, "rectification_matrix"), "rectification_matrix.data"
    if data is None or len(data) != 9:
        got = repr(document["rectification_matrix"])
        yield TableFault(key=key, got=got, expected="9 finite numbers")
        return
    matrix = np.array(data).reshape(3, 3)
    if not np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-3):
        yield TableFault(key=key, got=repr(data), expected="a rotation")
    elif not np.allclose(matrix, np.eye(3), atol=1e-3):
        expected = "1 0 0, 0 1 0, 0 0 1: the calibration of one camera, not of a rectified pair"
        yield TableFault(key=key, got=repr(data), expected=expected)


def _folds(document: Document, camera: CameraDescription) -> Iterator[TableFault]:
    """A polynomial that turns back inside the image shows two directions at one pixel."""
    fx, _, cx, _, fy, cy, *_ = _data(document, "camera_matrix") or []
    k = (_data(document, "distortion_coefficients") or []) + [0.0] * 8
    corner = max(
        math.hypot((u - cx) / fx, (v - cy) / fy)
        for u in (0, camera.width)
        for v in (0, camera.height)
    )
    radius = np.linspace(0.0, 4.0 * corner, 4 * _RADII)
    square = radius**2
    above = 1.0 + square * (k[0] + square * (k[1] + square * k[4]))
    below = 1.0 + square * (k[5] + square * (k[6] + square * k[7]))
    bent = radius * above / below
    turning = np.flatnonzero((np.diff(bent) <= 0.0) | (below[1:] <= 0.0))
    reach = bent[turning[0]] if turning.size else math.inf
    if np.any(below[: _RADII // 2] <= 0.0) or reach < corner:
        yield TableFault(
            key="distortion_coefficients.data",
            got=f"a lens that folds back at {reach:.2f} of {corner:.2f} to the corner",
            expected="one that does not: calibrate again, with views in the corners",
        )


def _data(document: Document, key: str) -> list[float] | None:
    """Return the numbers of a matrix; None where they are not a list of finite ones."""
    table = document.get(key)
    data = table.get("data") if isinstance(table, dict) else None
    if not isinstance(data, list) or not all(map(is_number, data)):
        return None
    return [float(value) for value in data]
