"""State what every camera must do."""

from typing import ClassVar

import numpy as np

from drivers.camera.base import ColourFrame, RgbdFrame
from sim_twin.contracts.sensors import (
    SensorChecks,
    SensorContract,
    UnplugContract,
    WireFaultContract,
)


class ColourChecks(SensorChecks):
    """Say what a sound colour image is."""

    def check(self, value: ColourFrame | RgbdFrame) -> None:
        """Assert the image's shape and kind."""
        assert value.rgb.ndim == 3
        assert value.rgb.shape[2] == 3
        assert value.rgb.dtype == np.uint8
        assert value.sequence >= 0


class RgbdChecks(ColourChecks):
    """Say what a sound image with depth is."""

    patience_s: ClassVar[float] = 1.5
    lost_bytes_every: ClassVar[int] = 50_000

    def check(self, value: ColourFrame | RgbdFrame) -> None:
        """Assert that colour, depth and calibration belong together."""
        super().check(value)
        assert isinstance(value, RgbdFrame)
        camera = value.intrinsics
        assert value.rgb.shape[:2] == value.depth.shape == (camera.height, camera.width)
        assert min(camera.fx, camera.fy) > 0.0
        assert np.isfinite(value.depth_m()).all()


class ColourCameraContract(ColourChecks, SensorContract):
    """Hold for any form of a colour camera."""


class RgbdCameraContract(RgbdChecks, SensorContract):
    """Hold for any form of an RGB-D camera."""


class RgbdCameraUnplugContract(RgbdChecks, UnplugContract):
    """Hold where the cable can be pulled."""


class RgbdCameraWireFaultContract(RgbdChecks, WireFaultContract):
    """Hold on a line that can be spoiled."""
