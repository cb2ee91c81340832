"""Decide how the ROS gateway's process is started: by which interpreter, in which environment."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from vla_deploy.robots import RobotDescription
from vla_deploy.robots.ros_settings import RosSettings
from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.ros_environment import find_environment, link_packages

DOMAIN: Final = "ROS_DOMAIN_ID"
DISCOVERY: Final = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PACKAGES_DIR: Final = "ros/packages"
LOGS_DIR: Final = "logs/ros"
TRANSPORT_PROFILE: Final = Path(__file__).with_name("fastdds_profile.xml")


def launch_environment(
    settings: RosSettings, run_dir: Path, inherited: Mapping[str, str] = os.environ
) -> tuple[Path, dict[str, str]]:
    """Return the interpreter, and what its environment has beside the supervisor's.

    Raises:
        RosNotFound: this computer has no ROS 2 Jazzy, or not where the robot file says.
    """
    found = find_environment(settings.python, settings.workspace)
    variables = dict(found.variables)
    packages = link_packages(run_dir / PACKAGES_DIR)
    paths = (str(packages), variables.get("PYTHONPATH", ""))
    variables["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    variables[DISCOVERY] = settings.discovery.upper()
    if settings.domain_id is not None:
        variables[DOMAIN] = str(settings.domain_id)
    variables["ROS_LOG_DIR"] = str(run_dir / LOGS_DIR)
    # An image is larger than the shared memory that Fast DDS takes by itself.
    profile = inherited.get("FASTRTPS_DEFAULT_PROFILES_FILE", str(TRANSPORT_PROFILE))
    variables["FASTRTPS_DEFAULT_PROFILES_FILE"] = profile
    return found.python, variables


def require_environment(robot: RobotDescription) -> None:
    """See that a robot which is driven or moved over ROS can be.

    Raises:
        RosNotFound: it is, and this computer has no ROS 2 Jazzy, or not where the robot file says.
    """
    settings = robot.ros
    if not settings.is_needed:
        return
    try:
        find_environment(settings.python, settings.workspace)
    except RosNotFound as error:
        raise RosNotFound(
            f"robot {robot.name}: [ros] says navigation = {settings.navigation!r} and arms = "
            f'{settings.arms!r}, which needs ROS; set both to "own", or: {error}'
        ) from error
