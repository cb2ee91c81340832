"""Emulate Dynamixel X servos at their wire."""

from sim_twin.servos.bank import ServoBank
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions

__all__ = ["Coupling", "EmulatedServoSpec", "FirmwareOptions", "ServoBank", "WireTiming"]
