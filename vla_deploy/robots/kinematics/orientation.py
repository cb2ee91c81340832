"""Read how MJCF turns a frame, in any of its ways, as a quaternion x, y, z, w.

Build and measure rotations as matrices, too.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Attributes = Mapping[str, str]

UNTURNED: Final = (0.0, 0.0, 0.0, 1.0)
_AXES: Final = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def numbers(text: str) -> Array:
    """Return the numbers of an attribute."""
    return np.array(text.split(), dtype=np.float64)


def turn(axis: Array, angle_rad: float) -> Array:
    """Return the quaternion of a turn about an axis of any length."""
    half = angle_rad / 2
    return np.append(axis / np.linalg.norm(axis) * math.sin(half), math.cos(half))


def product(first: Array, then: Array) -> Array:
    """Return the turn of a frame that is turned by `first` and, within that, by `then`."""
    (ax, ay, az, aw), (bx, by, bz, bw) = first, then
    return np.array(
        (
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )
    )


def matrix(quaternion: Array) -> Array:
    """Return a quaternion's rotation, 3 x 3."""
    x, y, z, w = quaternion
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
    )


def along(direction: Array) -> Array:
    """Return the least turn that brings z along a direction."""
    target = direction / np.linalg.norm(direction)
    axis = np.cross((0.0, 0.0, 1.0), target)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.array(UNTURNED if target[2] > 0 else (1.0, 0.0, 0.0, 0.0))
    return turn(axis, math.atan2(sine, float(target[2])))


def orientation(attributes: Attributes, radian: float, euler_order: str) -> Array:
    """Return how an element is turned in its parent; `radian` is one unit of its file's angles."""
    for way, read in _WAYS.items():
        if way in attributes:
            quaternion = read(numbers(attributes[way]), radian, euler_order)
            return quaternion / np.linalg.norm(quaternion)
    return np.array(UNTURNED)


def _from_euler(angles: Array, radian: float, order: str) -> Array:
    """Turn about the axes in order; small letters turn with the frame, capitals do not."""
    whole = np.array(UNTURNED)
    for letter, angle in zip(order, angles, strict=True):
        step = turn(np.array(_AXES[letter.lower()]), angle * radian)
        whole = product(whole, step) if letter.islower() else product(step, whole)
    return whole


def _from_axes(xy: Array, radian: float, order: str) -> Array:
    x = xy[:3] / np.linalg.norm(xy[:3])
    y = xy[3:] - x * (x @ xy[3:])
    y /= np.linalg.norm(y)
    return quaternion_of(np.column_stack((x, y, np.cross(x, y))))


def quaternion_of(rotation: Array) -> Array:
    """Return the quaternion of a rotation, 3 x 3."""
    # Of the quaternion's outer product with itself, the row that is largest is the most exact.
    xx, yy, zz = rotation.diagonal()
    square = np.array((1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz))
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = rotation
    outer = np.array(
        (
            (square[0], xy + yx, xz + zx, zy - yz),
            (xy + yx, square[1], yz + zy, xz - zx),
            (xz + zx, yz + zy, square[2], yx - xy),
            (zy - yz, xz - zx, yx - xy, square[3]),
        )
    )
    row: Array = outer[int(np.argmax(square))]
    return row / np.linalg.norm(row)


def angle_rad(rotation: Array) -> float:
    """Return by how much a 3 x 3 rotation turns, whichever way: 0 to pi."""
    cosine = (float(np.trace(rotation)) - 1.0) / 2.0
    return math.acos(min(1.0, max(-1.0, cosine)))


def yaw_rotation(yaw_rad: float) -> Array:
    """Return the 3 x 3 rotation about the vertical axis."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


_WAYS: Final[Mapping[str, Callable[[Array, float, str], Array]]] = {
    "quat": lambda wxyz, radian, order: np.roll(wxyz, -1),
    "axisangle": lambda values, radian, order: turn(values[:3], values[3] * radian),
    "euler": _from_euler,
    "xyaxes": _from_axes,
    "zaxis": lambda axis, radian, order: along(axis),
}
