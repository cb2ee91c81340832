"""Plan paths for a robot's base on its own map, around its keep-out zones."""

from typing import Final

from vla_deploy.navigation.maps.zones import with_zones
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.maps.grid_map import load_map

CLEARANCE_MARGIN_M: Final = 0.03
"""Air between the footprint and what stands on the map."""


def base_planner(robot: RobotDescription) -> PathPlanner:
    """Return what plans the base's paths.

    Raises:
        MapInvalid: the robot file's map cannot be used.
    """
    grid = with_zones(load_map(robot.home.map_path), robot.home.zones)
    return PathPlanner(grid, robot.base.footprint_radius_m + CLEARANCE_MARGIN_M)
