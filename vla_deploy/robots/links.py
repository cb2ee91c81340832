"""Say where a robot's devices are reached: as its file says, or all of them in one folder."""

from pathlib import Path

from drivers.opener import DeviceLink
from drivers.power_relay.lcus_relay import LCUS_BAUD
from drivers.registry import SensorKind, sensor_model
from vla_deploy.robots.description import RobotDescription


def device_links(robot: RobotDescription, devices_dir: Path | None = None) -> dict[str, DeviceLink]:
    """Return the link of every device; `devices_dir` replaces the file's own paths (twin mode)."""
    bauds = {
        robot.servo_bus.device: robot.servo_bus.baud,
    }
    parts = robot.parts
    if parts.can_bus is not None:
        bauds[parts.can_bus.device] = parts.can_bus.bitrate
    if parts.lidar is not None:
        bauds[parts.lidar.device] = sensor_model(SensorKind.LIDAR, parts.lidar.model).baud
    if parts.imu is not None:
        bauds[parts.imu.device] = sensor_model(SensorKind.IMU, parts.imu.model).baud
    if robot.power_relay is not None:
        bauds[robot.power_relay.device] = LCUS_BAUD
    optional = (parts.camera, robot.estop, robot.microphone, robot.speaker)
    bauds.update({device.device: 0 for device in optional if device})
    return {
        name: DeviceLink(path=robot.device_path(name, devices_dir), baud=baud)
        for name, baud in bauds.items()
    }
