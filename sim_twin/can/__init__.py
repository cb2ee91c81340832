"""Emulate a CAN bus and CiA 402 wheel drives on it."""

from sim_twin.can.drive import WheelDrive
from sim_twin.can.hub import CanHub
from sim_twin.can.memory_bus import MemoryBus
from sim_twin.can.wire import CanNode, CanWire

__all__ = ["CanHub", "CanNode", "CanWire", "MemoryBus", "WheelDrive"]
