"""Tell where a robot's devices are reached: as its file says, or all of them in one folder."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from drivers.opener import DeviceLink
from vla_deploy.robots.description import RobotDescription

SENSOR_BAUD: Mapping[str, int] = MappingProxyType({"LD19": 230_400, "BNO085-RVC": 115_200})


def device_links(robot: RobotDescription, devices_dir: Path | None = None) -> dict[str, DeviceLink]:
    """Return the link of every device; `devices_dir` replaces the file's own paths (twin mode)."""
    bauds = {
        robot.servo_bus.device: robot.servo_bus.baud,
        robot.can_bus.device: robot.can_bus.bitrate,
        robot.lidar.device: SENSOR_BAUD[robot.lidar.model],
        robot.imu.device: SENSOR_BAUD[robot.imu.model],
        robot.camera.device: 0,
    }
    return {
        name: DeviceLink(path=robot.device_path(name, devices_dir), baud=baud)
        for name, baud in bauds.items()
    }
