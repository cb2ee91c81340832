"""Publish the map and its keep-out zones once, and what stands around the robot now.

The last is a point cloud, and the map with what is seen in it; both are made only while somebody
listens.
"""

import logging
from array import array
from collections import deque
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from geometry_msgs.msg import Point
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from vla_deploy.gateways.ros.geometry import (
    BODY_RADIUS_M,
    BodyFrames,
    Floats,
    beam_points,
    depth_points,
    mark_seen,
    moved,
    near_segments,
    pose_of,
    standing,
    thinned,
)
from vla_deploy.gateways.ros.graph import LATCHED, RELIABLE, SENSOR
from vla_deploy.gateways.ros.outward.markers import marker_at
from vla_deploy.gateways.ros.part import MAP, Due, Gateway, GatewayPart
from vla_deploy.ipc import topics
from vla_deploy.ipc.rgbd_image import depths_m
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, LIDAR_FRAME, OPTICAL_FRAME
from vla_deploy.robots.maps.map_file import MapFile, read_map_file

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
_XYZ: Final = ("x_m", "y_m", "z_m")
_ZONE_COLOUR: Final = ColorRGBA(r=0.9, g=0.1, b=0.1, a=0.8)
_log = logging.getLogger(__name__)


def read_robot_map(gateway: Gateway) -> MapFile | None:
    """Return the robot's map, None where its file cannot be used: the log says why."""
    try:
        return read_map_file(gateway.robot.home.map_path)
    except MapInvalid as error:
        _log.warning("no map for the ROS graph: %s", error)
        return None


class StaticMap(GatewayPart):
    """Publish /map and /keep_out_zones, latched."""

    def __init__(self, gateway: Gateway, file: MapFile | None) -> None:
        graph = gateway.graph
        self._zones = graph.publisher(MarkerArray, "/keep_out_zones", LATCHED)
        self._zones.publish(_zones(gateway))
        self._map = graph.publisher(OccupancyGrid, "/map", LATCHED)
        if file is not None:
            self._map.publish(_grid_message(gateway, file.occupancy(), file))


class _Stance(NamedTuple):
    stamp_ns: int
    map_from_base: Floats
    positions: NDArray[np.float64]


class EnvironmentMap(GatewayPart):
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
            self._publish_cloud()
        if wants_grid:
            self._publish_grid()

    def _note_stance(self) -> None:
        link = self._gateway.link
        pose, joints = link.fresh(topics.POSE, _AGE_S), link.fresh(topics.JOINT_STATE, _AGE_S)
        if pose is None or joints is None or int(pose.data["state"]) > _TRACKING:
            self._stances.clear()  # a robot that is not sure where it is knows nothing of the map
            return
        self._stances.append(
            _Stance(
                stamp_ns=pose.stamp_ns,
                map_from_base=standing(pose_of(pose)),
                positions=np.array(joints.data["position"], dtype=np.float64),
            )
        )

    def _publish_cloud(self) -> None:
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

    def _publish_grid(self) -> None:
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
        self._grid.publish(_grid_message(self._gateway, cells, self._map))

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


def _grid_message(gateway: Gateway, cells: NDArray[np.int8], file: MapFile) -> OccupancyGrid:
    """Return cells of a map's size, row 0 in the south: 0 free to 100 occupied, -1 unknown."""
    message = OccupancyGrid()
    message.header.frame_id = MAP
    message.header.stamp = message.info.map_load_time = gateway.time.now()
    message.info.resolution = float(file.resolution_m)
    message.info.height, message.info.width = cells.shape
    origin = message.info.origin.position
    origin.x, origin.y = map(float, file.origin_m)
    message.data = array("b", np.ascontiguousarray(cells).tobytes())
    return message


def _zones(gateway: Gateway) -> MarkerArray:
    markers = []
    for number, zone in enumerate(gateway.robot.home.zones):
        marker = marker_at("keep_out", Marker.LINE_STRIP, _ZONE_COLOUR, (0.0, 0.0, 0.0))
        marker.id = number
        marker.header.frame_id = MAP
        marker.header.stamp = gateway.time.now()
        marker.scale.x = 0.05
        marker.text = f"{zone.name}: {zone.reason}"
        corners = (*zone.polygon_m, zone.polygon_m[0])
        marker.points = [Point(x=float(x_m), y=float(y_m)) for x_m, y_m in corners]
        markers.append(marker)
    return MarkerArray(markers=markers)
