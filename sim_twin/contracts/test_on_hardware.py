"""Ask the devices of a real robot to keep the contracts: `pytest --hardware robot.toml`.

Nothing is energised unless `--energise` is given, and then nothing is told to move.
"""

from typing import Any

import pytest

from drivers import registry
from drivers.clock import Clock
from drivers.dynamixel import DynamixelBus, ServoSpec
from drivers.wheel_drives.bus import DriveBus
from sim_twin.contracts.bench import HardwareBench
from sim_twin.contracts.camera import RgbdCameraContract
from sim_twin.contracts.drive_bus import DriveBusContract, DrivePowerContract
from sim_twin.contracts.hardware import Hardware
from sim_twin.contracts.imu import ImuContract
from sim_twin.contracts.lidar import LidarContract
from sim_twin.contracts.servo_bus import ServoBusContract, ServoTorqueContract
from vla_deploy.control.output.drive_buses import drive_bus
from vla_deploy.robots.servos.declared import servo_specs

CAMERA_HZ = 5.0


class _ServoBench:
    @pytest.fixture
    def bench(self, hardware: Hardware) -> HardwareBench[DynamixelBus]:
        """Give the servo bus of the robot file."""
        robot, profile = hardware.robot, hardware.profile

        def connect(clock: Clock) -> DynamixelBus:
            line = hardware.devices.serial(robot.servo_bus.device)
            bus = DynamixelBus(
                line,
                clock,
                [servo for servo in servo_specs(robot) if isinstance(servo, ServoSpec)],
                baud=robot.servo_bus.baud,
                watchdog_s=profile.bus_watchdog_s,
            )
            bus.connect()
            return bus

        return HardwareBench(connect)


class TestServoBus(_ServoBench, ServoBusContract):
    """Read every servo."""


@pytest.mark.energises
class TestServoTorque(_ServoBench, ServoTorqueContract):
    """Let every servo hold where it stands."""

    @pytest.fixture(autouse=True)
    def _watchdog(self, hardware: Hardware) -> None:
        type(self).watchdog_s = hardware.profile.bus_watchdog_s


class _DriveBench:
    @pytest.fixture
    def bench(self, hardware: Hardware) -> HardwareBench[DriveBus]:
        """Give the wheel drives of the robot file."""
        robot, profile = hardware.robot, hardware.profile

        def connect(clock: Clock) -> DriveBus:
            opened = hardware.devices.can(robot.can_bus.device)
            bus = drive_bus(robot.can_bus, profile, opened, clock)
            bus.connect()
            return bus

        return HardwareBench(connect)


class TestDriveBus(_DriveBench, DriveBusContract):
    """Watch the wheel drives."""


@pytest.mark.energises
class TestDrivePower(_DriveBench, DrivePowerContract):
    """Give the wheel drives power."""


class TestLidar(LidarContract):
    """Read the lidar."""

    @pytest.fixture
    def bench(self, hardware: Hardware) -> HardwareBench[Any]:
        """Give the lidar of the robot file."""
        wired, devices = hardware.robot.lidar, hardware.devices
        return HardwareBench(
            lambda clock: registry.open_lidar(wired.model, devices.serial(wired.device), clock)
        )


class TestImu(ImuContract):
    """Read the inertial sensor."""

    @pytest.fixture
    def bench(self, hardware: Hardware) -> HardwareBench[Any]:
        """Give the inertial sensor of the robot file."""
        wired, devices = hardware.robot.imu, hardware.devices
        return HardwareBench(
            lambda clock: registry.open_imu(wired.model, devices.serial(wired.device), clock)
        )


class TestCamera(RgbdCameraContract):
    """Read the RGB-D camera."""

    @pytest.fixture
    def bench(self, hardware: Hardware) -> HardwareBench[Any]:
        """Give the camera of the robot file."""
        wired, devices = hardware.robot.camera, hardware.devices
        return HardwareBench(
            lambda clock: registry.open_camera(
                wired.model,
                devices.stream(wired.device) if wired.has_depth else devices.video(wired.device),
                clock,
                rate_hz=CAMERA_HZ,
                pinhole=wired.pinhole,
            )
        )
