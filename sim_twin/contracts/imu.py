"""State what every inertial sensor must do; the sensor stands still meanwhile."""

import math

from drivers.imu.base import ImuSample
from sim_twin.contracts.sensors import (
    SensorChecks,
    SensorContract,
    UnplugContract,
    WireFaultContract,
)

MIN_FORCE_M_S2 = 8.0
MAX_FORCE_M_S2 = 12.0


class ImuChecks(SensorChecks):
    """Say what a sound sample of a sensor at rest is."""

    def check(self, value: ImuSample) -> None:
        """Assert that the angles are angles and that gravity is felt."""
        assert -math.pi <= value.yaw_rad <= math.pi
        assert -math.pi / 2 <= value.pitch_rad <= math.pi / 2
        assert -math.pi <= value.roll_rad <= math.pi
        assert MIN_FORCE_M_S2 < math.hypot(*value.acceleration_m_s2) < MAX_FORCE_M_S2


class ImuContract(ImuChecks, SensorContract):
    """Hold for any form of an inertial sensor."""


class ImuUnplugContract(ImuChecks, UnplugContract):
    """Hold where the cable can be pulled."""


class ImuWireFaultContract(ImuChecks, WireFaultContract):
    """Hold on a line that can be spoiled."""
