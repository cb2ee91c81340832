"""Remember what the depth camera saw standing up from the floor around the base.

The camera looks over what is close, and sees a cup on the floor only from a metre away. So points
are kept in cells of the map frame until they are seen to be gone or are too old.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.ipc.topics import OBSTACLE_POINTS
from vla_deploy.navigation.obstacles.movers import BODY_M
from vla_deploy.perception.geometry.cloud import PosedImage, sparse_points
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.orientation import yaw_rotation

Array = NDArray[np.float64]
Cell = tuple[int, int]

# Lower things are taken for the floor: depth noise, a carpet, the slant of a wheel on its edge.
LOWEST_M = 0.05
HIGHEST_M = 1.3
CELL_M = 0.04
MIN_PIXELS = 2
SEEN_WITHIN_M = 2.5
KEPT_WITHIN_M = 1.5
KEPT_NS = 8 * NS_PER_S
# An image and a scan of one moment are up to a period of either apart.
SAME_MOMENT_NS = NS_PER_S // 4
# A cup hides the table close behind it; what is in view is seen anew wherever it stays.
GONE_M = 0.04
MIN_DEPTH_M = 0.2
# A thing in a hand reaches this far from the grip.
HELD_M = 0.22
# What stood this near to a full hand is what it holds; further off it may be the table.
TAKEN_M = 0.1


class _Seen(NamedTuple):
    at: tuple[float, float, float]
    last_ns: int
    first_ns: int


class NearObstacles:
    """Hold the cells that stand up from the floor, each with its newest point."""

    def __init__(self) -> None:
        self._cells: dict[Cell, _Seen] = {}

    def update(self, image: PosedImage, grips: Sequence[Array]) -> None:
        """Process an image; `grips` are points of full hands in the base frame."""
        self._forget_gone(image)
        self._forget_grasped(grips, image.base)
        points = _standing(image)
        for grip in grips:
            points = points[np.linalg.norm(points - grip, axis=1) > HELD_M]
        turned = _to_map(points, image.base)
        keys = np.floor(turned[:, :2] / CELL_M).astype(np.int64)
        _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
        for index in first[counts >= MIN_PIXELS]:
            x_m, y_m, z_m = turned[index].tolist()
            column, row = keys[index].tolist()
            before = self._cells.get((column, row))
            first_ns = image.stamp_ns if before is None else before.first_ns
            self._cells[column, row] = _Seen((x_m, y_m, z_m), image.stamp_ns, first_ns)

    def around(self, pose: Pose2D, now_ns: int) -> Array:
        """Return what stands near the base, (n, 3) in the base frame, the nearest first."""
        points = _to_base(self.on_map(now_ns), pose)
        distance = np.linalg.norm(points[:, :2], axis=1)
        order = np.argsort(distance, kind="stable")[:OBSTACLE_POINTS]
        near: Array = points[order[distance[order] <= KEPT_WITHIN_M]]
        return near

    def forget_left(self, left: Array) -> None:
        """Drop what was never seen but with somebody there who has walked away since.

        `left` are rows of stamp (ns), x, y of the map frame, where they were.
        """
        if not self._cells or not len(left):
            return
        points = self._points()[:, :2]
        by_them = np.linalg.norm(points[:, None] - left[None, :, 1:], axis=2) < BODY_M
        gone = np.ones(len(points), dtype=np.bool_)
        seen_ns = np.array([(one.first_ns, one.last_ns) for one in self._cells.values()])
        for stamps_ns in seen_ns.T:
            then = np.abs(stamps_ns[:, None] - left[None, :, 0]) < SAME_MOMENT_NS
            gone &= (by_them & then).any(axis=1)
        self._forget(gone)

    def on_map(self, now_ns: int) -> Array:
        """Return all that is remembered, (n, 3) in the map frame."""
        self._cells = {
            cell: kept for cell, kept in self._cells.items() if now_ns - kept.last_ns <= KEPT_NS
        }
        return self._points()

    def _points(self) -> Array:
        kept = [cell.at for cell in self._cells.values()]
        return np.array(kept, dtype=np.float64).reshape(-1, 3)

    def _forget_gone(self, image: PosedImage) -> None:
        """Drop cells through which the camera looks at something further away."""
        if not self._cells:
            return
        camera = image.camera
        points = _to_base(self._points(), image.base) - image.base_from_camera[:3, 3]
        local = points @ image.base_from_camera[:3, :3]
        ahead = local[:, 2].copy()
        local[:, 2] = np.maximum(ahead, MIN_DEPTH_M)
        column, row = np.rint(project(camera, local)).astype(np.int64).T
        seen = (ahead > MIN_DEPTH_M) & (column >= 0) & (column < camera.width)
        seen &= (row >= 0) & (row < camera.height)
        at = (row[seen], column[seen])
        gone = np.zeros(len(points), dtype=np.bool_)
        gone[seen] = (image.depth_m[at] > ahead[seen] + GONE_M) & ~image.body[at]
        self._forget(gone)

    def _forget_grasped(self, grips: Sequence[Array], pose: Pose2D) -> None:
        """Drop cells near a full hand, which carries away what stood there."""
        for grip in grips:
            points = _to_base(self._points(), pose)
            self._forget(np.linalg.norm(points - grip, axis=1) < TAKEN_M)

    def _forget(self, gone: NDArray[np.bool_]) -> None:
        self._cells = {
            cell: kept
            for (cell, kept), is_gone in zip(self._cells.items(), gone, strict=True)
            if not is_gone
        }


def _standing(image: PosedImage) -> Array:
    """Return the points between floor and robot's height, of some of the pixels."""
    points = sparse_points(
        image.depth_m,
        image.camera,
        image.base_from_camera,
        image.body,
        within_m=(MIN_DEPTH_M, SEEN_WITHIN_M),
    )
    return points[(points[:, 2] > LOWEST_M) & (points[:, 2] < HIGHEST_M)]


def _to_map(points: Array, pose: Pose2D) -> Array:
    turned: Array = points @ yaw_rotation(pose.yaw_rad).T + (pose.x_m, pose.y_m, 0.0)
    return turned


def _to_base(points: Array, pose: Pose2D) -> Array:
    turned: Array = (points - (pose.x_m, pose.y_m, 0.0)) @ yaw_rotation(pose.yaw_rad)
    return turned
