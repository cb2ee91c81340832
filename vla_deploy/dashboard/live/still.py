"""Tell what of robot and home does not move: the robot's links, the map, places and zones."""

from dataclasses import asdict
from functools import cached_property
from typing import Any, Final

import cv2

from vla_deploy.navigation.maps.map_file import MapFile, read_map_file
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.kinematic_tree import KinematicTree
from vla_deploy.robots.kinematics.tree_reader import read_tree

_DIGITS: Final = 6


class Still:
    """Hold a robot's description in the forms that a page draws; made when first asked for."""

    def __init__(self, robot: RobotDescription) -> None:
        self.robot = robot

    @cached_property
    def tree(self) -> KinematicTree:
        """Return the robot's links."""
        return read_tree(self.robot.mjcf_path)

    @cached_property
    def model(self) -> dict[str, Any]:
        """Return links and safety zones, all in the base frame.

        Wheels turn by no joint of the arrays: they are drawn where they are at zero.
        """
        robot = self.robot
        return {
            "name": robot.name,
            "joint_names": robot.joint_names,
            "footprint_m": robot.base.footprint_radius_m,
            "links": [_rounded(asdict(link)) for link in self.tree.links],
            "zones": [
                {"name": zone.name, "kind": zone.kind, "polygon_m": zone.polygon_m}
                for zone in robot.protection.zones
            ],
        }

    @cached_property
    def map(self) -> dict[str, Any]:
        """Return where the map's picture lies, and what has a name on it.

        Raises:
            MapInvalid: the robot's map cannot be used.
        """
        home, (height, width) = self.robot.home, self._map_file.shades.shape
        return {
            "resolution_m": self._map_file.resolution_m,
            "origin": self._map_file.origin_m,
            "width": width,
            "height": height,
            "places": [
                {"name": one.name, "aliases": one.aliases, **asdict(one.pose)}
                for one in home.places.values()
            ],
            "keep_out": [asdict(zone) for zone in home.zones],
        }

    @cached_property
    def map_png(self) -> bytes:
        """Return the map's shades; the first row is the northernmost.

        Raises:
            MapInvalid: the robot's map cannot be used.
        """
        _, png = cv2.imencode(".png", self._map_file.shades)
        return png.tobytes()

    @cached_property
    def _map_file(self) -> MapFile:
        return read_map_file(self.robot.home.map_path)


def _rounded(value: Any) -> Any:
    """Return a document whose numbers are as fine as a page can draw them."""
    if isinstance(value, dict):
        return {key: _rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(one) for one in value]
    return round(value, _DIGITS) if isinstance(value, float) else value
