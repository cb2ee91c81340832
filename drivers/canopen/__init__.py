"""Drive CiA 402 wheel drives over CANopen."""

from drivers.canopen.cia402 import Goal, PowerState
from drivers.canopen.emergency import Emergency
from drivers.canopen.objects import EDS_PATH
from drivers.canopen.open_bus import open_can_bus
from drivers.canopen.spec import DriveSpec, DriveState
from drivers.canopen.wheel_bus import WheelDriveBus

__all__ = [
    "EDS_PATH",
    "DriveSpec",
    "DriveState",
    "Emergency",
    "Goal",
    "PowerState",
    "WheelDriveBus",
    "open_can_bus",
]
