"""State what every planar lidar must do."""

import numpy as np

from drivers.lidar.base import BEAMS, Scan
from sim_twin.contracts.sensors import (
    SensorChecks,
    SensorContract,
    UnplugContract,
    WireFaultContract,
)

MAX_RANGE_M = 100.0


class LidarChecks(SensorChecks):
    """Say what a sound scan is."""

    def check(self, value: Scan) -> None:
        """Assert that beams, times and turn rate can be those of a turning head."""
        assert value.range_m.shape == value.beam_stamp_ns.shape == (BEAMS,)
        assert np.isfinite(value.range_m).all()
        assert value.range_m.min() >= 0.0
        assert value.range_m.max() < MAX_RANGE_M
        assert value.beam_stamp_ns.max() == value.stamp_ns
        assert value.stamp_ns - value.beam_stamp_ns.min() < 1.5e9 / value.turn_hz
        assert 1.0 <= value.turn_hz <= 30.0


class LidarContract(LidarChecks, SensorContract):
    """Hold for any form of a lidar."""


class LidarUnplugContract(LidarChecks, UnplugContract):
    """Hold where the cable can be pulled."""


class LidarWireFaultContract(LidarChecks, WireFaultContract):
    """Hold on a line that can be spoiled."""
