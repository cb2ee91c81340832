"""Reach the devices of a real robot from tests."""

from pathlib import Path

from drivers.clock import MonotonicClock
from drivers.opener import PathOpener
from platforms import Profile, load_profile
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.robots.links import device_links

CONTRACTS = Path(__file__).with_name("test_on_hardware.py")


class Hardware:
    """Hold a robot's description and open its devices."""

    def __init__(self, robot_file: Path, devices_dir: Path | None, profile: str) -> None:
        """Read the robot file; nothing is opened yet.

        Raises:
            RobotFileError: the file is not there or has faults.
        """
        folder = robot_file.parent if robot_file.is_file() else robot_file
        self.robot: RobotDescription = load_robot(str(folder))
        self.profile: Profile = load_profile(profile)
        self.devices = PathOpener(device_links(self.robot, devices_dir), MonotonicClock())
