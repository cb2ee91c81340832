"""Drive CiA 402 wheel drives over CANopen."""

from drivers.canopen.emergency import Emergency
from drivers.canopen.objects import EDS_PATH, DriveMode
from drivers.canopen.spec import DriveSpec
from drivers.canopen.wheel_bus import WheelDriveBus
from drivers.wheel_drives.bus import DriveGoal, PowerState

__all__ = [
    "EDS_PATH",
    "DriveGoal",
    "DriveMode",
    "DriveSpec",
    "Emergency",
    "PowerState",
    "WheelDriveBus",
]
