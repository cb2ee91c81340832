"""List what the gateway's process imports from outside Python and this project: one table.

It runs in ROS's own environment, so there is nothing else to import: whatever a gateway module or a
module of ours that it imports needs must be in this table, or in Python's standard library.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

BUILT_FROM_SOURCE: Final = "colcon build --base-paths ros   # in a checkout; docs/ros.md"


@dataclass(frozen=True, slots=True, kw_only=True)
class RosImport:
    """Name what provides a module on a robot (apt), and in an environment of wheels (pip).

    `apt` is empty for what is built from this project's `ros/`, `wheel` for what no wheel brings:
    `scripts/ros-environment` builds that.
    """

    apt: str
    wheel: str
    is_message_package: bool = True


def _messages(name: str, *, has_wheel: bool = True) -> RosImport:
    part = name.replace("_", "-")
    return RosImport(apt=f"ros-jazzy-{part}", wheel=f"ros-{part}" if has_wheel else "")


IMPORTS: Final[Mapping[str, RosImport]] = {
    "numpy": RosImport(apt="python3-numpy", wheel="numpy", is_message_package=False),
    "yaml": RosImport(apt="python3-yaml", wheel="pyyaml", is_message_package=False),
    "rclpy": RosImport(apt="ros-jazzy-rclpy", wheel="ros-rclpy", is_message_package=False),
    "action_msgs": _messages("action_msgs"),
    "builtin_interfaces": _messages("builtin_interfaces"),
    "control_msgs": _messages("control_msgs", has_wheel=False),
    "diagnostic_msgs": _messages("diagnostic_msgs"),
    "geometry_msgs": _messages("geometry_msgs"),
    "lifecycle_msgs": _messages("lifecycle_msgs"),
    "nav2_msgs": _messages("nav2_msgs", has_wheel=False),
    "nav_msgs": _messages("nav_msgs"),
    "rcl_interfaces": _messages("rcl_interfaces"),
    "rosgraph_msgs": _messages("rosgraph_msgs"),
    "sensor_msgs": _messages("sensor_msgs"),
    "std_msgs": _messages("std_msgs"),
    "std_srvs": _messages("std_srvs"),
    "tf2_msgs": _messages("tf2_msgs", has_wheel=False),
    "trajectory_msgs": _messages("trajectory_msgs"),
    "unique_identifier_msgs": _messages("unique_identifier_msgs"),
    "visualization_msgs": _messages("visualization_msgs"),
    "vla_deploy_msgs": RosImport(apt="", wheel=""),
}


def remedy(module: str) -> str:
    """Return the command that installs a module of the table on a robot."""
    apt = IMPORTS[module].apt
    return f"sudo apt-get install -y {apt}" if apt else BUILT_FROM_SOURCE
