"""Drive ODrive axes over their CANSimple protocol."""

from drivers.odrive.axis_bus import ODriveBus
from drivers.odrive.endpoints import EMULATED_ENDPOINTS
from drivers.odrive.spec import AxisSpec

__all__ = ["EMULATED_ENDPOINTS", "AxisSpec", "ODriveBus"]
