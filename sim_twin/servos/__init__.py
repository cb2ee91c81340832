"""Emulate Dynamixel X servos at their wire."""

from sim_twin.servos.bank import ServoBank
from sim_twin.servos.coupling import Coupling
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions
from sim_twin.servos.timing import WireTiming

__all__ = ["Coupling", "EmulatedServoSpec", "FirmwareOptions", "ServoBank", "WireTiming"]
