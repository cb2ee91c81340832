"""Talk to every device of the twin as a robot at work does, with the real drivers and no more."""

import math
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S
from drivers.imu.bno085_rvc import Bno085Rvc
from drivers.lidar.ld19 import Ld19
from platforms import load_profile
from sim_twin.harness.lockstep import Lockstep
from vla_deploy.control.output.base_drive import can_wheels
from vla_deploy.control.output.servos import ServoLine

PERIOD_S: Final = 0.004
_SENSORS_EVERY: Final = 5
_SWAY_RAD: Final = 0.15
_SWAY_HZ: Final = 0.5
_TURN_RAD_S: Final = 0.5
_POWER_TIMEOUT_S: Final = 5.0


class NotMoving(Exception):
    """Say that the devices refuse to be powered."""


class DeviceTraffic:
    """Read and command 16 servos and two drives every 4 ms, poll lidar and IMU every 20 ms.

    Every joint sways about where it started and the base turns to and fro, all under torque.
    """

    period_s = PERIOD_S

    def __init__(self, lockstep: Lockstep) -> None:
        robot, devices, clock = lockstep.robot, lockstep.devices, lockstep.clock
        profile = load_profile(lockstep.context.profile)
        self._clock = clock
        self._servos = ServoLine(robot, profile, devices, clock)
        self._wheels = can_wheels(robot, profile, devices, clock)
        self._lidar = Ld19(devices.serial(robot.lidar.device), clock)
        self._imu = Bno085Rvc(devices.serial(robot.imu.device), clock)
        self._low, self._high = robot.position_min, robot.position_max
        self._centre = np.zeros(len(robot.joint_names))
        self._started_ns = 0
        self._cycles = 0

    def start(self) -> None:
        """Connect to both buses and power everything.

        Raises:
            NotMoving: a servo or a drive refuses.
            DriverError: a device is silent or not the one declared.
        """
        self._servos.open()
        self._wheels.open()
        self._centre = self._servos.state.position_rad.copy()
        for row in range(len(self._centre)):
            if not self._servos.energise(row):
                raise NotMoving(self._servos.failure)
        self._wheels.enable()
        self._started_ns = self._clock.now_ns()

    def step(self) -> None:
        """Do one bus cycle, and poll the sensors in every fifth."""
        swing = math.sin(math.tau * _SWAY_HZ * (self._clock.now_ns() - self._started_ns) / NS_PER_S)
        self._servos.read()
        goals = self._centre + _SWAY_RAD * swing
        self._servos.write(np.minimum(np.maximum(goals, self._low), self._high))
        self._wheels.cycle(0.0, _TURN_RAD_S * swing)
        self._cycles += 1
        if self._cycles % _SENSORS_EVERY == 0:
            self._lidar.poll()
            self._imu.poll()

    def await_motion(self, lockstep: Lockstep) -> None:
        """Run until everything is powered.

        Raises:
            NotMoving: it takes too long.
        """
        if not lockstep.run_until(lambda: self._moving, _POWER_TIMEOUT_S):
            raise NotMoving(f"servos or drives have no power after {_POWER_TIMEOUT_S:g} s")

    @property
    def _moving(self) -> bool:
        return bool(self._servos.state.torque_on.all()) and self._wheels.enabled

    def stop(self) -> None:
        """Let go of every device."""
        for device in (self._servos, self._wheels, self._lidar, self._imu):
            device.close()
