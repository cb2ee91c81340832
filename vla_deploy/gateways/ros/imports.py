"""List what the gateway's process imports from outside Python and this project: one table."""

from collections.abc import Mapping
from typing import Final

BUILT_FROM_SOURCE: Final = "colcon build --base-paths ros   # in a checkout; docs/ros.md"
MESSAGES: Final = (
    *("action_msgs", "builtin_interfaces", "control_msgs", "diagnostic_msgs", "geometry_msgs"),
    *("lifecycle_msgs", "nav2_msgs", "nav_msgs", "rcl_interfaces", "rosgraph_msgs"),
    *("sensor_msgs", "std_msgs", "std_srvs", "tf2_msgs", "trajectory_msgs"),
    *("unique_identifier_msgs", "visualization_msgs", "vla_deploy_msgs"),
)
IMPORTS: Final[Mapping[str, str]] = {
    "numpy": "python3-numpy",
    "yaml": "python3-yaml",
    "rclpy": "ros-jazzy-rclpy",
    **{name: f"ros-jazzy-{name.replace('_', '-')}" for name in MESSAGES},
    "vla_deploy_msgs": "",
}
"""All that the gateway imports from outside Python and this project, with its package of apt.

What a gateway module, or one of ours that it imports, needs must be here: ROS's environment has
nothing else. A module without a package is built from this project's `ros/`.
"""


def remedy(module: str) -> str:
    """Return the command that installs a module of the table on a robot."""
    apt = IMPORTS[module]
    return f"sudo apt-get install -y {apt}" if apt else BUILT_FROM_SOURCE
