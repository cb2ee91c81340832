"""Make the twin's devices fail, in every way of one vocabulary; nothing of this is on the robot."""

from sim_twin.faults.injector import FaultHandle, FaultInjector
from sim_twin.faults.vocabulary import Component, Fault

__all__ = ["Component", "Fault", "FaultHandle", "FaultInjector"]
