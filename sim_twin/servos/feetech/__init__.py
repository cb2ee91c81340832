"""Emulate FEETECH STS, SMS and SCS servos at their wire."""

from sim_twin.servos.feetech.bank import FeetechBank
from sim_twin.servos.feetech.spec import EmulatedFeetechSpec, FeetechOptions

__all__ = ["EmulatedFeetechSpec", "FeetechBank", "FeetechOptions"]
