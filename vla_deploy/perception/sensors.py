"""Keep lidar, IMU and camera open, and reopen each when its link breaks."""

import logging
import math
from dataclasses import replace
from typing import Any

from drivers import registry
from drivers.camera.base import Camera, RgbdFrame
from drivers.camera.protocol import Intrinsics
from drivers.clock import Clock
from drivers.imu.base import Imu, ImuSample
from drivers.lidar.base import Lidar, Scan
from drivers.opener import DeviceOpener
from drivers.reopening import Reopening
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.model import RobotModel, full_positions

_log = logging.getLogger(__name__)


class Sensors:
    """Read each sensor there is; one that is away returns nothing, and the others go on."""

    def __init__(
        self,
        robot: RobotDescription,
        model: RobotModel,
        devices: DeviceOpener,
        clock: Clock,
        camera_rate_hz: float,
    ) -> None:
        self._robot = robot
        self._model = model
        self._devices = devices
        self._clock = clock
        self._camera_rate_hz = camera_rate_hz
        self._has_logged_size = False
        parts = robot.parts
        self._lidar = Reopening("lidar", self._open_lidar, clock) if parts.lidar else None
        self._imu = Reopening("imu", self._open_imu, clock) if parts.imu else None
        self._camera = Reopening("camera", self._open_camera, clock)

    def open(self) -> None:
        """Open every sensor.

        Raises:
            DriverError: a sensor is missing or busy.
        """
        for slot in self._slots:
            slot.open()

    def close(self) -> None:
        """Release every sensor; closing twice is allowed."""
        for slot in self._slots:
            slot.close()

    @property
    def _slots(self) -> list[Reopening[Any]]:
        return [slot for slot in (self._lidar, self._imu, self._camera) if slot is not None]

    def scan(self) -> Scan | None:
        """Return a new scan of the lidar, if there is one."""
        if self._lidar is None:
            return None
        return self._lidar.poll(lambda lidar: lidar.poll(), None)

    def attitude(self) -> ImuSample | None:
        """Return the newest sample of the IMU, if there is a new one."""
        if self._imu is None:
            return None
        none: list[ImuSample] = []
        samples = self._imu.poll(lambda imu: imu.poll(), none)
        return samples[-1] if samples else None

    def image(self) -> RgbdFrame | None:
        """Return a new image of the camera, if there is one, with its calibrated lens."""
        frame = self._camera.poll(lambda camera: camera.poll(), None)
        lens = self._robot.camera.lens
        if frame is None or lens is None:
            return frame
        sent, known = frame.intrinsics, lens.intrinsics
        if (sent.width, sent.height) == (known.width, known.height):
            return replace(frame, intrinsics=known)
        self._log_other_size(sent, known)
        return frame

    def set_camera_rate(self, rate_hz: float) -> None:
        """Reopen the camera where it is to send at another rate."""
        if rate_hz != self._camera_rate_hz:
            self._camera_rate_hz = rate_hz
            self._camera.close()

    def away(self) -> dict[str, str]:
        """Return which sensors are away at present, each with the reason."""
        slots = {"lidar": self._lidar, "imu": self._imu, "camera": self._camera}
        return {name: slot.failure for name, slot in slots.items() if slot and slot.failure}

    def _log_other_size(self, sent: Intrinsics, known: Intrinsics) -> None:
        """Log once that the calibration does not fit, so that the camera's own intrinsics count."""
        if not self._has_logged_size:
            self._has_logged_size = True
            _log.error(
                "degraded: the camera sends %dx%d, its lens was calibrated at %dx%d; its own "
                "intrinsics are taken; calibrate it anew: vla-deploy camera calibrate",
                sent.width,
                sent.height,
                known.width,
                known.height,
            )

    def _open_lidar(self) -> Lidar:
        robot_lidar = self._robot.lidar
        pose = self._model.site_pose(robot_lidar.site, full_positions(self._robot))
        yaw_rad = math.atan2(pose[1, 0], pose[0, 0])
        line = self._devices.serial(robot_lidar.device)
        return registry.open_lidar(robot_lidar.model, line, self._clock, mounting_yaw_rad=yaw_rad)

    def _open_imu(self) -> Imu:
        imu = self._robot.imu
        return registry.open_imu(imu.model, self._devices.serial(imu.device), self._clock)

    def _open_camera(self) -> Camera[RgbdFrame]:
        camera = self._robot.camera
        opens = self._devices.stream if camera.has_depth else self._devices.video
        return registry.open_camera(
            camera.model,
            opens(camera.device),
            self._clock,
            rate_hz=self._camera_rate_hz,
            pinhole=camera.pinhole,
        )
