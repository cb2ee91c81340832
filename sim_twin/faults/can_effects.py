"""Declare what may befall the CAN bus, and each drive on it."""

from typing import Final

from sim_twin.can import WheelDrive
from sim_twin.faults.effect import Effect, Ending, Target
from sim_twin.faults.line_effects import Rows
from sim_twin.faults.vocabulary import Component, Fault

DRIVE_OVERHEATED: Final = 0x4310
DRIVE_OVERLOADED: Final = 0x2310
_TEMPERATURE_REGISTER: Final = 0x09
_CURRENT_REGISTER: Final = 0x03


def _cut(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.cut = True

    def end() -> None:
        wire.cut = False

    return end


def _drive(target: Target) -> WheelDrive:
    return next(drive for drive in target.twin.drives if drive.node_id == target.number)


def _off(target: Target) -> Ending:
    drive = _drive(target)
    drive.set_supply(False)
    return lambda: drive.set_supply(True)


def _trip(code: int, error_register: int, summary: str) -> Effect:
    """Return a fault that the drive reports itself; a fault reset ends it, clearing does not."""

    def begin(target: Target) -> Ending:
        _drive(target).raise_fault(code, error_register)
        return lambda: None

    return Effect(summary=summary, begin=begin)


CAN_ROWS: Final[Rows] = {
    (Component.CAN_BUS, Fault.UNPLUG): Effect(summary="the cable is out", begin=_cut),
    (Component.DRIVE, Fault.OFF): Effect(summary="without supply", begin=_off),
    (Component.DRIVE, Fault.OVERHEAT): _trip(
        DRIVE_OVERHEATED, _TEMPERATURE_REGISTER, "reports over-temperature (EMCY 4310h)"
    ),
    (Component.DRIVE, Fault.OVERLOAD): _trip(
        DRIVE_OVERLOADED, _CURRENT_REGISTER, "reports over-current (EMCY 2310h)"
    ),
}
