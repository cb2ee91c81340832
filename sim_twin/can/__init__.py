"""Emulate a CAN bus, and wheel drives on it: CiA 402 over CANopen, and ODrive axes."""

from sim_twin.can.bus.hub import CanHub
from sim_twin.can.bus.memory_bus import MemoryBus
from sim_twin.can.bus.wire import CanNode, CanWire
from sim_twin.can.cia402.drive import WheelDrive
from sim_twin.can.drives import DRIVES, robot_drives
from sim_twin.can.emulated_drive import EmulatedDrive, MotorMounting
from sim_twin.can.odrive.axis import ODriveAxis

__all__ = [
    "DRIVES",
    "CanHub",
    "CanNode",
    "CanWire",
    "EmulatedDrive",
    "MemoryBus",
    "MotorMounting",
    "ODriveAxis",
    "WheelDrive",
    "robot_drives",
]
