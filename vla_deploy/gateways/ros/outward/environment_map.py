"""Publish what stands around the robot now: a point cloud, and the map with what is seen in it.

Both are made only while somebody listens.
"""

from collections import deque
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from vla_deploy.gateways.ros.geometry.body_frames import BODY_RADIUS_M, BodyFrames
from vla_deploy.gateways.ros.geometry.planar import planar_of
from vla_deploy.gateways.ros.geometry.points import (
    beam_points,
    depth_points,
    mark_seen,
    moved,
    near_segments,
    planar_pose,
    thinned,
)
from vla_deploy.gateways.ros.graph import RELIABLE, SENSOR
from vla_deploy.gateways.ros.outward.body import MAP
from vla_deploy.gateways.ros.outward.maps import grid_message
from vla_deploy.gateways.ros.part import Due, Gateway
from vla_deploy.ipc import topics
from vla_deploy.ipc.rgbd_image import depths_m
from vla_deploy.navigation.maps.map_file import MapFile
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, LIDAR_FRAME, OPTICAL_FRAME

CLOUD: Final = "/environment_map"
GRID: Final = "/environment_map/grid"
RATE_HZ: Final = 1.0
MOST_POINTS: Final = 6_000
STRIDE: Final = 4
"""Every so many pixels of every so many rows are looked at."""
FAR_M: Final = 8.0
_TRACKING: Final = 0
_AGE_S: Final = 0.5
_IMAGE_AGE_S: Final = 1.0
_KEPT: Final = 64
"""Looks at pose and joints, of a second or more, by which an image finds those of its moment."""

Floats = NDArray[np.float64]


class _Stance(NamedTuple):
    stamp_ns: int
    map_from_base: Floats
    positions: NDArray[np.float64]


class EnvironmentMap:
    """Publish /environment_map and /environment_map/grid, both in the map's frame."""

    def __init__(self, gateway: Gateway, frames: BodyFrames, file: MapFile | None) -> None:
        graph = gateway.graph
        self._gateway = gateway
        self._frames = frames
        self._cloud = graph.publisher(PointCloud2, CLOUD, SENSOR)
        self._grid = graph.publisher(OccupancyGrid, GRID, RELIABLE)
        self._map = file
        self._stances: deque[_Stance] = deque(maxlen=_KEPT)
        self._due = Due(RATE_HZ)
        self._look_due = Due(_KEPT / 2.0)

    def step(self, now_ns: int) -> None:
        """Note where the robot is, and publish what is due, while somebody listens."""
        wants_cloud = self._cloud.get_subscription_count() > 0
        wants_grid = self._map is not None and self._grid.get_subscription_count() > 0
        if not wants_cloud and not wants_grid:
            self._stances.clear()
            return
        if self._look_due.is_now(now_ns):
            self._note_stance()
        if not self._stances or not self._due.is_now(now_ns):
            return
        if wants_cloud:
            self._tell_cloud()
        if wants_grid:
            self._tell_grid()

    def stop(self) -> None:
        """Leave nothing under way."""

    def _note_stance(self) -> None:
        link = self._gateway.link
        pose, joints = link.fresh(topics.POSE, _AGE_S), link.fresh(topics.JOINT_STATE, _AGE_S)
        if pose is None or joints is None or int(pose.data["state"]) > _TRACKING:
            self._stances.clear()  # a robot that is not sure where it is knows nothing of the map
            return
        self._stances.append(
            _Stance(
                stamp_ns=pose.stamp_ns,
                map_from_base=planar_pose(*planar_of(pose)),
                positions=np.array(joints.data["position"], dtype=np.float64),
            )
        )

    def _tell_cloud(self) -> None:
        parts = [self._seen_by_camera(), self._near(), self._seen_by_lidar()]
        points = thinned(np.vstack(parts), MOST_POINTS)
        message = PointCloud2(
            height=1,
            width=len(points),
            fields=[
                PointField(name=name, offset=4 * place, datatype=PointField.FLOAT32, count=1)
                for place, name in enumerate("xyz")
            ],
            is_bigendian=False,
            point_step=12,
            row_step=12 * len(points),
            is_dense=True,
        )
        message.header.frame_id = MAP
        message.header.stamp = self._gateway.time.stamp(self._stances[-1].stamp_ns)
        message.data.frombytes(points.astype("<f4").tobytes())
        self._cloud.publish(message)

    def _tell_grid(self) -> None:
        if self._map is None:
            return
        cells = self._map.occupancy()
        for sensor, seen in ((LIDAR_FRAME, self._seen_by_lidar()), (BASE_FRAME, self._near())):
            eye = self._stances[-1].map_from_base @ self._poses(self._stances[-1])[sensor]
            mark_seen(
                cells,
                self._map.resolution_m,
                self._map.origin_m,
                (float(eye[0, 3]), float(eye[1, 3])),
                seen[:, :2],
            )
        self._grid.publish(grid_message(self._gateway, cells, self._map))

    def _seen_by_camera(self) -> Floats:
        """Return what the depth image shows, without the robot's own arms, in the map."""
        frame = self._gateway.link.frame(topics.RGBD, _IMAGE_AGE_S)
        lens = self._gateway.robot.camera.intrinsics
        if frame is None or (frame.width, frame.height) != (lens.width, lens.height):
            return np.empty((0, 3))
        stance = min(self._stances, key=lambda one: abs(one.stamp_ns - frame.stamp_ns))
        poses = self._poses(stance)
        points = moved(depth_points(depths_m(frame), lens, STRIDE), poses[OPTICAL_FRAME])
        own = near_segments(points, *self._frames.segments(poses), BODY_RADIUS_M)
        return moved(points[~own], stance.map_from_base)

    def _near(self) -> Floats:
        """Return what perception has found to stand up from the floor nearby, in the map."""
        sample = self._gateway.link.fresh(topics.NEAR_OBSTACLES, 1.0)
        if sample is None:
            return np.empty((0, 3))
        count = int(sample.data["count"])
        columns = [np.asarray(sample.data[name], np.float64)[:count] for name in _XYZ]
        return moved(np.column_stack(columns), self._stances[-1].map_from_base)

    def _seen_by_lidar(self) -> Floats:
        sample = self._gateway.link.fresh(topics.SCAN, _AGE_S)
        if sample is None:
            return np.empty((0, 3))
        stance = min(self._stances, key=lambda one: abs(one.stamp_ns - sample.stamp_ns))
        map_from_lidar = stance.map_from_base @ self._poses(stance)[LIDAR_FRAME]
        return moved(beam_points(sample.data["range_m"], FAR_M), map_from_lidar)

    def _poses(self, stance: _Stance) -> Mapping[str, Floats]:
        return self._frames.poses(stance.positions)


_XYZ: Final = ("x_m", "y_m", "z_m")
