from drivers.dynamixel.bus import DynamixelBus
from drivers.dynamixel.bus_group import BusGroup
from drivers.dynamixel.handshake import ServoSetup
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import OperatingMode
from drivers.dynamixel.tables.layout import BlockLayout
from drivers.dynamixel.watchdog import WatchdogState

__all__ = [
    "BlockLayout",
    "BusGroup",
    "DynamixelBus",
    "OperatingMode",
    "ServoSetup",
    "ServoSpec",
    "WatchdogState",
]
