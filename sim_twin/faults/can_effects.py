"""Declare what may befall the CAN bus, and each drive on it."""

from typing import Final

from sim_twin.can import EmulatedDrive
from sim_twin.can.power_stage import MotorSpec
from sim_twin.faults.effect import Effect, Ending, FaultParameter, Target
from sim_twin.faults.line_effects import DELAY, Rows
from sim_twin.faults.vocabulary import Component, Fault

_SUPPLY_V: Final = MotorSpec().supply_v


def _drive(target: Target) -> EmulatedDrive:
    return next(drive for drive in target.twin.drives if drive.node_id == target.number)


def _cut(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.cut = True

    def end() -> None:
        wire.cut = False

    return end


def _bus_off(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.set_bus_off()
    return wire.restart


def _babble(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.babble(on=True)
    return lambda: wire.babble(on=False)


def _damage(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.corrupt(target.values["ratio"], target.seed)
    return lambda: wire.corrupt(0.0)


def _delay(target: Target) -> Ending:
    wire = target.twin.can_wire
    wire.delay(target.values["delay_s"])
    return lambda: wire.delay(0.0)


def _mistune_all(target: Target) -> Ending:
    return _mistuned(target, target.twin.drives)


def _mistune(target: Target) -> Ending:
    return _mistuned(target, (_drive(target),))


def _mistuned(target: Target, drives: tuple[EmulatedDrive, ...]) -> Ending:
    wire = target.twin.can_wire

    def switch(on: bool) -> None:
        for drive in drives:
            wire.set_wrong_bitrate(drive, on)

    switch(True)
    return lambda: switch(False)


def _off(target: Target) -> Ending:
    drive = _drive(target)
    drive.set_supply(False)
    return lambda: drive.set_supply(True)


def _stick(target: Target) -> Ending:
    drive = _drive(target)
    drive.freeze(True)
    return lambda: drive.freeze(False)


def _run_away(target: Target) -> Ending:
    drive = _drive(target)
    drive.run_away(target.values["speed_rad_s"])
    return lambda: drive.run_away(0.0)


def _clash(target: Target) -> Ending:
    other = next(drive for drive in target.twin.drives if drive.node_id != target.number)
    own_id = other.node_id
    other.set_node_id(target.number)
    return lambda: other.set_node_id(own_id)


def _overheat(target: Target) -> Ending:
    drive = _drive(target)
    drive.overheat()
    return drive.cool


def _overload(target: Target) -> Ending:
    drive = _drive(target)
    drive.overload(True)
    return lambda: drive.overload(False)


def _brown_out(target: Target) -> Ending:
    drive = _drive(target)
    drive.set_supply_v(target.values["volts_v"])
    return lambda: drive.set_supply_v(_SUPPLY_V)


_DAMAGED: Final = FaultParameter(
    name="ratio", default=1.0, low=0.001, high=1.0, meaning="share of the frames that are destroyed"
)

_SPEED: Final = FaultParameter(
    name="speed_rad_s", default=2.0, low=-20.0, high=20.0, meaning="wheel speed beyond what is told"
)
_VOLTS: Final = FaultParameter(
    name="volts_v", default=12.0, low=0.0, high=60.0, meaning="voltage it drops to"
)

CAN_ROWS: Final[Rows] = {
    (Component.CAN_BUS, Fault.GARBAGE): Effect(
        summary="frames fail their check sum", begin=_damage, parameters=(_DAMAGED,)
    ),
    (Component.CAN_BUS, Fault.DELAYED): Effect(
        summary="every frame comes late", begin=_delay, parameters=(DELAY,)
    ),
    (Component.CAN_BUS, Fault.UNPLUG): Effect(summary="the cable is out", begin=_cut),
    (Component.CAN_BUS, Fault.WRONG_BAUD): Effect(
        summary="every drive at another bit rate than the host", begin=_mistune_all
    ),
    (Component.CAN_BUS, Fault.BUS_OFF): Effect(
        summary="the host's controller leaves the bus, until cleared or opened anew", begin=_bus_off
    ),
    (Component.CAN_BUS, Fault.ARBITRATION_LOSS): Effect(
        summary="a babbling node wins every arbitration", begin=_babble
    ),
    (Component.DRIVE, Fault.OFF): Effect(summary="without supply", begin=_off),
    (Component.DRIVE, Fault.STUCK): Effect(
        summary="tells for ever what its encoder told last; its own loop goes on", begin=_stick
    ),
    (Component.DRIVE, Fault.WRONG): Effect(
        summary="turns although nobody told it to", begin=_run_away, parameters=(_SPEED,)
    ),
    (Component.DRIVE, Fault.BROWN_OUT): Effect(
        summary="its supply sags", begin=_brown_out, parameters=(_VOLTS,)
    ),
    (Component.DRIVE, Fault.OVERHEAT): Effect(
        summary="hot until cleared; then a fault reset ends it", begin=_overheat
    ),
    (Component.DRIVE, Fault.OVERLOAD): Effect(
        summary="full current as in a jammed gear; its I²t guard trips after some 20 s",
        begin=_overload,
    ),
    (Component.DRIVE, Fault.ID_CLASH): Effect(
        summary="another drive of the bus takes its id", begin=_clash
    ),
    (Component.DRIVE, Fault.WRONG_BAUD): Effect(
        summary="at another bit rate than the bus", begin=_mistune
    ),
}
