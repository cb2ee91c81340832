"""Publish the map and its keep-out zones, once and for whoever comes later."""

import logging
from array import array

import numpy as np
from geometry_msgs.msg import Point
from nav_msgs.msg import OccupancyGrid
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from vla_deploy.gateways.ros.graph import LATCHED
from vla_deploy.gateways.ros.outward.body import MAP
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.robots.errors import MapInvalid
from vla_deploy.robots.maps.map_file import MapFile, read_map_file

_log = logging.getLogger(__name__)
_ZONE_COLOUR = ColorRGBA(r=0.9, g=0.1, b=0.1, a=0.8)


def read_robot_map(gateway: Gateway) -> MapFile | None:
    """Return the robot's map, None where its file cannot be used: the log says why."""
    try:
        return read_map_file(gateway.robot.home.map_path)
    except MapInvalid as error:
        _log.warning("no map for the ROS graph: %s", error)
        return None


class StaticMap:
    """Publish /map and /keep_out_zones, latched."""

    def __init__(self, gateway: Gateway, file: MapFile | None) -> None:
        graph = gateway.graph
        self._zones = graph.publisher(MarkerArray, "/keep_out_zones", LATCHED)
        self._zones.publish(_zones(gateway))
        self._map = graph.publisher(OccupancyGrid, "/map", LATCHED)
        if file is not None:
            self._map.publish(grid_message(gateway, file.occupancy(), file))

    def step(self, now_ns: int) -> None:
        """Publish nothing: a map does not change while a robot runs."""

    def stop(self) -> None:
        """Leave nothing under way."""


def grid_message(gateway: Gateway, cells: NDArray[np.int8], file: MapFile) -> OccupancyGrid:
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
        marker = Marker(ns="keep_out", id=number, type=Marker.LINE_STRIP, action=Marker.ADD)
        marker.header.frame_id = MAP
        marker.header.stamp = gateway.time.now()
        marker.pose.orientation.w = 1.0
        marker.scale.x = 0.05
        marker.color = _ZONE_COLOUR
        marker.text = f"{zone.name}: {zone.reason}"
        corners = (*zone.polygon_m, zone.polygon_m[0])
        marker.points = [Point(x=float(x_m), y=float(y_m)) for x_m, y_m in corners]
        markers.append(marker)
    return MarkerArray(markers=markers)
