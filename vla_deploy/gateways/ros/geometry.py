"""Place the body's frames, turn depth images and scans into points, and points into cells.

NumPy alone does it. The optical frame has z forward, x right, y down. Poses are 4 x 4, lengths
are metres.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from vla_deploy.ipc import Sample
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, FrameTransform, FrameTree
from vla_deploy.robots.kinematics.orientation import matrix

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

DEPTH_RANGE_M: Final = (0.2, 4.0)
CELL_M: Final = 0.04
"""How near two points of a cloud may be: of those in a cube of this side one is kept."""
_UNDOING: Final = 20
_COEFFICIENTS: Final = 8
FREE: Final = 0
OCCUPIED: Final = 100
BODY_RADIUS_M: Final = 0.12
"""How far from the line between two of its frames a link reaches."""


def pose_of(sample: Sample) -> Pose2D:
    """Return the pose on the floor that a cell holds."""
    data = sample.data
    return Pose2D(float(data["x_m"]), float(data["y_m"]), float(data["yaw_rad"]))


def standing(pose: Pose2D) -> Floats:
    """Return the 4 x 4 pose of a frame that stands on the floor."""
    cosine, sine = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    stands = np.eye(4)
    stands[:2, :2] = ((cosine, -sine), (sine, cosine))
    stands[:2, 3] = pose.x_m, pose.y_m
    return stands


class BodyFrames:
    """Answer for joint values where each frame is in the base frame, as a 4 x 4 pose."""

    def __init__(self, robot: RobotDescription) -> None:
        self._tree = FrameTree.of(robot)
        self._names = robot.joint_names
        self._fixed = {one.child: one for one in self._tree.fixed}

    def poses(self, positions: NDArray[np.floating]) -> Mapping[str, Floats]:
        """Return every frame's pose; `positions` are in the joint order, more do not count."""
        values = dict(zip(self._names, positions[: len(self._names)].tolist(), strict=True))
        moving = {one.child: one for one in self._tree.transforms(values)}
        poses: dict[str, Floats] = {BASE_FRAME: np.eye(4)}
        for joint in self._tree.joints:  # a parent comes before what hangs on it
            transform = moving.get(joint.child) or self._fixed[joint.child]
            poses[joint.child] = poses[joint.parent] @ _placed(transform)
        return poses

    def segments(self, poses: Mapping[str, Floats]) -> tuple[Floats, Floats]:
        """Return the lines from each frame to the next, begins and ends n x 3, in the base."""
        pairs = [
            (poses[joint.parent][:3, 3], poses[joint.child][:3, 3])
            for joint in self._tree.moving
            if joint.parent != BASE_FRAME
        ]
        begins, ends = zip(*pairs, strict=True) if pairs else ((), ())
        return np.array(begins).reshape(-1, 3), np.array(ends).reshape(-1, 3)


def moved(points: Floats, pose: Floats) -> Floats:
    """Return points, n x 3, of an inner frame as the outer one has them."""
    result: Floats = points @ pose[:3, :3].T + pose[:3, 3]
    return result


def depth_points(depths_m: NDArray[np.floating], lens: Intrinsics, stride: int) -> Floats:
    """Return the points, n x 3 in the optical frame, of every so many pixels that have a depth."""
    low_m, high_m = DEPTH_RANGE_M
    depths = depths_m[::stride, ::stride].astype(np.float64)
    seen = (depths > low_m) & (depths < high_m)
    rays = _rays(lens, stride)[seen]
    return np.column_stack((rays, np.ones(len(rays)))) * depths[seen][:, None]


def pixels_of(points: Floats, lens: Intrinsics) -> Floats:
    """Return where points of the optical frame, all in front, appear in pixels, n x 2."""
    bent = _distorted(points[:, :2] / points[:, 2:], lens.distortion)
    result: Floats = bent * (lens.fx, lens.fy) + (lens.cx, lens.cy)
    return result


def beam_points(range_m: NDArray[np.floating], far_m: float) -> Floats:
    """Return where beams met something, n x 3 in the lidar's frame; beam i is at i degrees."""
    ranges = np.asarray(range_m, dtype=np.float64)
    beams = np.flatnonzero((ranges > 0.0) & (ranges < far_m))
    angles = beams * (2.0 * math.pi / len(ranges))
    return np.column_stack(
        (ranges[beams] * np.cos(angles), ranges[beams] * np.sin(angles), np.zeros(len(beams)))
    )


def thinned(points: Floats, most: int, cell_m: float = CELL_M) -> Floats:
    """Return one point of each cube that holds any, and at most so many, evenly left out."""
    if not len(points):
        return points
    cubes = np.floor(points / cell_m).astype(np.int64)
    _, first = np.unique(cubes, axis=0, return_index=True)
    kept = points[np.sort(first)]
    if len(kept) <= most:
        return kept
    return kept[np.linspace(0, len(kept) - 1, most).astype(np.int64)]


def near_segments(points: Floats, begins: Floats, ends: Floats, radius_m: float) -> Mask:
    """Return which points lie within a radius of any of the segments, m x 3 both."""
    near = np.zeros(len(points), dtype=bool)
    for begin, end in zip(begins, ends, strict=True):
        along = end - begin
        length2 = float(along @ along)
        share = (points - begin) @ along / length2 if length2 > 0.0 else np.zeros(len(points))
        nearest = begin + np.clip(share, 0.0, 1.0)[:, None] * along
        near |= ((points - nearest) ** 2).sum(axis=1) < radius_m**2
    return near


def mark_seen(
    cells: NDArray[np.int8],
    resolution_m: float,
    origin_m: tuple[float, float],
    eye_m: tuple[float, float],
    hits: Floats,
) -> None:
    """Mark in a grid what was seen from a place: hits are occupied, what lies before them free.

    `cells` has row 0 in the south; what lies off the grid is left out. A cell that is occupied on
    the map stays so where beams only pass it: a wall is not gone because its top was not met.
    """
    before: list[Floats] = []
    for hit in hits:
        way = hit - np.array(eye_m)
        steps = max(int(np.hypot(*way) / resolution_m), 1)
        shares = np.arange(steps) / steps
        before.append(np.array(eye_m) + shares[:, None] * way)
    if before:
        rows, columns = _inside(np.vstack(before), cells.shape, resolution_m, origin_m)
        unknown = cells[rows, columns] < 0
        cells[rows[unknown], columns[unknown]] = FREE
    rows, columns = _inside(hits, cells.shape, resolution_m, origin_m)
    cells[rows, columns] = OCCUPIED


def _inside(
    points: Floats,
    shape: tuple[int, ...],
    resolution_m: float,
    origin_m: tuple[float, float],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cells = np.floor((points.reshape(-1, 2) - origin_m) / resolution_m).astype(np.int64)
    columns, rows = cells.T
    inside = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    return rows[inside], columns[inside]


def _placed(transform: FrameTransform) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = matrix(np.array(transform.quaternion))
    pose[:3, 3] = transform.xyz
    return pose


@lru_cache(maxsize=4)
def _rays(lens: Intrinsics, stride: int) -> Floats:
    columns, rows = np.meshgrid(np.arange(0, lens.width, stride), np.arange(0, lens.height, stride))
    bent = np.stack(((columns - lens.cx) / lens.fx, (rows - lens.cy) / lens.fy), axis=-1)
    flat = bent.reshape(-1, 2)
    rays = flat.copy()
    if lens.distortion:
        for _ in range(_UNDOING):  # the fixed point of: ray = bent - (what bends it)
            rays = flat - (_distorted(rays, lens.distortion) - rays)
    return rays.reshape(bent.shape)


def _distorted(rays: Floats, coefficients: Sequence[float]) -> Floats:
    """Return rays as the lens bends them: k1 k2 p1 p2 k3 k4 k5 k6, as OpenCV and ROS have it."""
    if not coefficients:
        return rays
    padded = [*coefficients, *([0.0] * (_COEFFICIENTS - len(coefficients)))]
    k1, k2, p1, p2, k3, k4, k5, k6 = padded
    x, y = rays[..., 0], rays[..., 1]
    square = x * x + y * y
    radial = (1 + square * (k1 + square * (k2 + square * k3))) / (
        1 + square * (k4 + square * (k5 + square * k6))
    )
    return np.stack(
        (
            x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
            y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
        ),
        axis=-1,
    )
