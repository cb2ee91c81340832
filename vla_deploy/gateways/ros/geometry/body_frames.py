"""Compute where the body's frames are, for what is told in the map's frame."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, FrameTransform, FrameTree
from vla_deploy.robots.kinematics.orientation import matrix

Floats = NDArray[np.float64]
BODY_RADIUS_M: Final = 0.12
"""How far from the line between two of its frames a link reaches."""


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
            poses[joint.child] = poses[joint.parent] @ _pose(transform)
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


def _pose(transform: FrameTransform) -> Floats:
    pose = np.eye(4)
    pose[:3, :3] = matrix(np.array(transform.quaternion))
    pose[:3, 3] = transform.xyz
    return pose
