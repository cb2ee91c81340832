"""Emulate a CAN bus, and wheel drives on it: CiA 402 over CANopen, and ODrive axes."""

from sim_twin.can.drive import WheelDrive
from sim_twin.can.drives import DRIVES, robot_drives
from sim_twin.can.emulated_drive import EmulatedDrive, MotorMounting
from sim_twin.can.hub import CanHub
from sim_twin.can.memory_bus import MemoryBus
from sim_twin.can.odrive import ODriveAxis
from sim_twin.can.wire import CanNode, CanWire

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
