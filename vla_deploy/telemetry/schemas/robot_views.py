"""Draw the robot and its sensors: joints, frames, odometry, lidar, obstacles, camera."""

import base64
import math
from typing import Final

import numpy as np

from vla_deploy.ipc.topics import SCAN_BEAMS
from vla_deploy.robots import RobotDescription
from vla_deploy.telemetry.schemas.foxglove_json import (
    BASE,
    CAMERA,
    MAP,
    ODOM,
    Json,
    floor_pose_json,
    matrix_json,
    point_json,
    time_json,
)

_FLOAT32: Final = 7  # foxglove.NumericType
_FLOAT_BYTES: Final = 4
# By whether there are more than five coefficients: the model's name, and its number of them.
_DISTORTION: Final = (("plumb_bob", 5), ("rational_polynomial", 8))


class RobotViews:
    """Draw what depends on the robot's kinematics; one instance per thread."""

    def __init__(self, robot: RobotDescription) -> None:
        """Build the robot's kinematics.

        Raises:
            RobotFileError: pinocchio does not find the robot file's joints in the MJCF.
        """
        from vla_deploy.robots.kinematics.model import RobotModel, full_positions  # loads pinocchio

        self._model = RobotModel(robot)
        self._names = robot.joint_names
        self._sees = robot.parts.camera is not None
        lidar = robot.parts.lidar
        self._lidar_m = (
            np.zeros(3)
            if lidar is None
            else self._model.site_pose(lidar.site, full_positions(robot))[:3, 3]
        )

    def joints(self, state: np.void, stamp_ns: int) -> Json:
        """Return every joint's position and velocity, leaving out NaN."""
        joints = []
        for index, name in enumerate(self._names):
            numbers = {field: float(state[field][index]) for field in ("position", "velocity")}
            finite = {field: value for field, value in numbers.items() if math.isfinite(value)}
            joints.append({"name": name, **finite})
        return {"timestamp": time_json(stamp_ns), "joints": joints}

    def frames(self, state: np.void, stamp_ns: int) -> Json:
        """Return the frames of joints and camera in the base; none while a position is unknown."""
        positions = np.array(state["position"][: len(self._names)], dtype=np.float64)
        if not np.isfinite(positions).all():
            return {"transforms": []}
        poses = dict(self._model.joint_poses(positions))
        if self._sees:
            poses[CAMERA] = self._model.camera_pose(positions)
        frames = [_frame(BASE, name, *matrix_json(at), stamp_ns) for name, at in poses.items()]
        return {"transforms": frames}

    def scan(self, scan: np.void, stamp_ns: int) -> Json:
        """Return a scan of the lidar from its place on the base; 0 is no return."""
        x_m, y_m, z_m = self._lidar_m
        return {
            "timestamp": time_json(stamp_ns),
            "frame_id": BASE,
            "pose": floor_pose_json(x_m, y_m, 0.0, z_m),
            "start_angle": 0.0,
            "end_angle": 2 * math.pi * (SCAN_BEAMS - 1) / SCAN_BEAMS,
            "ranges": np.nan_to_num(scan["range_m"], posinf=0.0).round(3).tolist(),
            "intensities": [],
        }


def base_frame(pose: np.void, stamp_ns: int) -> Json:
    """Return the base's pose in the map as a frame."""
    at = floor_pose_json(pose["x_m"], pose["y_m"], pose["yaw_rad"])
    return {"transforms": [_frame(MAP, BASE, at["position"], at["orientation"], stamp_ns)]}


def pose(pose: np.void, stamp_ns: int) -> Json:
    """Return the base's pose in the map."""
    at = floor_pose_json(pose["x_m"], pose["y_m"], pose["yaw_rad"])
    return {"timestamp": time_json(stamp_ns), "frame_id": MAP, "pose": at}


def odometry(state: np.void, stamp_ns: int) -> Json:
    """Return pose and velocity of the base by its wheels."""
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": ODOM,
        "body_frame_id": BASE,
        "pose": floor_pose_json(state["x_m"], state["y_m"], state["yaw_rad"]),
        "linear_velocity": point_json(state["v_m_s"], state["left_m_s"]),
        "angular_velocity": point_json(0.0, 0.0, state["w_rad_s"]),
    }


def obstacles(seen: np.void, stamp_ns: int) -> Json:
    """Return the obstacles seen near the base as points in its frame."""
    count = int(seen["count"])
    points = np.stack([seen[axis][:count] for axis in ("x_m", "y_m", "z_m")], axis=1)
    fields = [
        {"name": name, "offset": _FLOAT_BYTES * place, "type": _FLOAT32}
        for place, name in enumerate("xyz")
    ]
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": BASE,
        "pose": floor_pose_json(0.0, 0.0, 0.0),
        "point_stride": 3 * _FLOAT_BYTES,
        "fields": fields,
        "data": base64.b64encode(points.astype("<f4").tobytes()).decode(),
    }


def lens(robot: RobotDescription, stamp_ns: int) -> Json:
    """Return the camera's intrinsics, as calibrated or as in the robot file."""
    seen = robot.camera.intrinsics
    model, count = _DISTORTION[len(seen.distortion) > 5]
    return {
        "timestamp": time_json(stamp_ns),
        "frame_id": CAMERA,
        "width": seen.width,
        "height": seen.height,
        "distortion_model": model if seen.distortion else "",
        "D": [*seen.distortion, *[0.0] * (count - len(seen.distortion))] if seen.distortion else [],
        "K": [seen.fx, 0.0, seen.cx, 0.0, seen.fy, seen.cy, 0.0, 0.0, 1.0],
        "R": np.eye(3).ravel().tolist(),
        "P": [seen.fx, 0.0, seen.cx, 0.0, 0.0, seen.fy, seen.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def _frame(parent: str, child: str, translation: Json, rotation: Json, stamp_ns: int) -> Json:
    return {
        "timestamp": time_json(stamp_ns),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": translation,
        "rotation": rotation,
    }
