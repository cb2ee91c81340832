from drivers.dynamixel.bus import DynamixelBus
from drivers.dynamixel.bus_group import BusGroup
from drivers.dynamixel.counters import BusCounters
from drivers.dynamixel.handshake import ServoSetup
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import BusState
from drivers.dynamixel.tables.control_table import HardwareError, OperatingMode
from drivers.dynamixel.tables.layout import BlockLayout
from drivers.dynamixel.watchdog import WatchdogState

__all__ = [
    "BlockLayout",
    "BusCounters",
    "BusGroup",
    "BusState",
    "DynamixelBus",
    "HardwareError",
    "OperatingMode",
    "ServoSetup",
    "ServoSpec",
    "WatchdogState",
]
