"""Tell where in the camera's picture the things are that perception has just seen.

Pose and joints are the newest ones, up to a tenth of a second younger than the picture: while the
head turns, boxes run ahead of it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from vla_deploy.ipc import Frame, SharedSpace
from vla_deploy.perception.geometry.lens import project
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.kinematic_tree import KinematicTree

Array = NDArray[np.float64]

SEEN_NS: Final = 3 * NS_PER_S // 2
"""What was seen last longer before the picture is remembered, not detected."""
NEAREST_M: Final = 0.1
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2.0


class Detections:
    """Project what `scene` tells into pictures."""

    def __init__(self, space: SharedSpace, robot: RobotDescription, tree: KinematicTree) -> None:
        self._robot = robot
        self._tree = tree
        self._scene = space.cell_reader("scene")
        self._pose = space.cell_reader("pose")
        self._joints = space.cell_reader("joint_state")

    def in_frame(self, frame: Frame) -> list[dict[str, Any]]:
        """Return what is in a picture: names, confidence, and boxes in its pixels."""
        scene, camera = self._scene.latest(), self._camera_from_map()
        if scene is None or camera is None:
            return []
        document = scene.document()
        found = []
        for thing, corners in _cuboids(document, frame.stamp_ns):
            box = self._box(corners @ camera[:3, :3].T + camera[:3, 3], frame)
            if box is not None:
                found.append({**thing, "box": box})
        return found

    def _camera_from_map(self) -> Array | None:
        pose, joints = self._pose.latest(), self._joints.latest()
        if pose is None or joints is None:
            return None
        values = dict(zip(self._robot.joint_names, joints.data["position"].tolist(), strict=False))
        camera = self._robot.camera
        base_from_camera = self._tree.site_pose(camera.site, values) @ camera.site_from_camera
        x_m, y_m, yaw_rad = (float(pose.data[name]) for name in ("x_m", "y_m", "yaw_rad"))
        map_from_base = np.eye(4)
        map_from_base[:3, :3] = _turned(yaw_rad)
        map_from_base[:2, 3] = x_m, y_m
        inverse: Array = np.asarray(np.linalg.inv(map_from_base @ base_from_camera), np.float64)
        return inverse

    def _box(self, corners: Array, frame: Frame) -> list[float] | None:
        """Return left, top, right, bottom within the picture; None for what is not in it."""
        if corners[:, 2].min() < NEAREST_M:
            return None
        pixels = project(self._robot.camera.intrinsics, corners)
        size = (frame.width, frame.height)
        low, high = np.clip(pixels.min(axis=0), 0, size), np.clip(pixels.max(axis=0), 0, size)
        if (high - low).min() < 1.0:
            return None
        return [round(float(value), 1) for value in (*low, *high)]


def _cuboids(scene: Mapping[str, Any], stamp_ns: int) -> Iterator[tuple[dict[str, Any], Array]]:
    """Yield what was seen just now, and the corners of its cuboid in the map."""
    for thing in scene.get("objects", ()):
        if abs(stamp_ns - thing["last_seen_ns"]) <= SEEN_NS:
            names = {key: thing[key] for key in ("id", "class", "colour", "confidence")}
            turned = _CORNERS * thing["size_m"] @ _turned(thing.get("yaw_rad", 0.0)).T
            yield names, turned + thing["position_m"]
    if abs(stamp_ns - scene.get("stamp_ns", 0)) > SEEN_NS:
        return
    for one in scene.get("bystanders", ()):
        names = {"id": None, "colour": "", "class": one["class"], "confidence": one["confidence"]}
        yield names, _standing(one["position_m"], one["width_m"], one["top_m"])


def _standing(position_m: Sequence[float], width_m: float, top_m: float) -> Array:
    corners: Array = _CORNERS * (width_m, width_m, top_m)
    middle: Array = np.array((position_m[0], position_m[1], top_m / 2))
    return corners + middle


def _turned(yaw_rad: float) -> Array:
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array(((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)))
