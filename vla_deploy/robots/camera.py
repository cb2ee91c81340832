"""Describe a robot's camera: what the robot file says of it, and what was calibrated."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from drivers.registry import SensorKind, sensor_model
from vla_deploy.robots.kinematics.orientation import matrix

MOST_PIXELS: Final = 640 * 480
"""Of an image: so many have room between processes (`ipc.topics.RGBD`)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LensCalibration:
    """Hold what was measured of a lens; what a file of another tool does not have is None or ""."""

    intrinsics: Intrinsics
    distortion_model: str
    reprojection_error_px: float | None
    views: int | None
    made_at: str
    tool: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraMounting:
    """Hold by how much the camera sits otherwise than its site, measured with a lens `focal_px`.

    `residual_m` is how far apart the measurements put the board; `made_at` is a date for people.
    """

    site: str
    model: str
    focal_px: float
    translation_m: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float]
    residual_m: float
    made_at: str

    def matrix(self) -> NDArray[np.float64]:
        """Return the camera's optical frame in the frame of its site, 4 x 4."""
        quaternion = np.array(self.quaternion_xyzw)
        pose: NDArray[np.float64] = np.eye(4)
        pose[:3, :3] = matrix(quaternion / np.linalg.norm(quaternion))
        pose[:3, 3] = self.translation_m
        return pose


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDescription:
    """Describe the camera; `site` is its optical frame: x right, y down, z forward.

    `lens` and `mounting` are what calibration measured; None means as the camera itself states,
    and as drawn in the MJCF.
    """

    device: str
    path: str
    model: str
    site: str
    width: int
    height: int
    fovy_rad: float
    lens: LensCalibration | None = None
    mounting: CameraMounting | None = None

    @property
    def has_depth(self) -> bool:
        """Return whether its images come with depth."""
        return sensor_model(SensorKind.CAMERA, self.model).has_depth

    @property
    def intrinsics(self) -> Intrinsics:
        """Return the calibrated lens, or the pinhole of the robot file's opening angle."""
        return self.pinhole if self.lens is None else self.lens.intrinsics

    @property
    def pinhole(self) -> Intrinsics:
        """Return the lens without faults that has the robot file's size and opening angle."""
        return Intrinsics(
            width=self.width,
            height=self.height,
            fx=self.focal_px,
            fy=self.focal_px,
            cx=(self.width - 1) / 2,
            cy=(self.height - 1) / 2,
        )

    @property
    def site_from_camera(self) -> NDArray[np.float64]:
        """Return where the camera sits in the frame of its site, 4 x 4."""
        return np.eye(4) if self.mounting is None else self.mounting.matrix()

    @property
    def focal_px(self) -> float:
        """Return the focal length in pixels, the same in both directions."""
        return float(self.height / 2 / np.tan(self.fovy_rad / 2))
