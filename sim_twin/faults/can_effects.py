"""Declare what may befall the CAN bus, and each drive on it."""

from typing import Final

import can

from drivers.canopen.objects import SYNC_COB, TPDO1
from sim_twin.can import EmulatedDrive
from sim_twin.can.wire import Port
from sim_twin.faults.effect import Effect, Ending, Parameter, Target
from sim_twin.faults.line_effects import DELAY, Rows
from sim_twin.faults.vocabulary import Component, Fault

DRIVE_OVERHEATED: Final = 0x4310
DRIVE_OVERLOADED: Final = 0x2310
_TEMPERATURE_REGISTER: Final = 0x09
_CURRENT_REGISTER: Final = 0x03


class ClashingNode:
    """Be a second drive of one node id: it answers each SYNC with a status of its own."""

    def __init__(self, node_id: int) -> None:
        self.supplied = True
        self._cob_id = TPDO1.cob_base + node_id
        self._send: Port = lambda frame: None

    def connect(self, send: Port) -> None:
        """Remember how to put a frame on the wire."""
        self._send = send

    def receive(self, frame: can.Message) -> None:
        """Answer a SYNC."""
        if self.supplied and frame.arbitration_id == SYNC_COB and not frame.is_error_frame:
            self._send(
                can.Message(
                    arbitration_id=self._cob_id,
                    is_extended_id=False,
                    data=TPDO1.wire.pack(0xFFFF, -1),
                )
            )


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


def _clash(target: Target) -> Ending:
    node = ClashingNode(target.number)
    target.twin.can_wire.add_node(node)

    def end() -> None:
        node.supplied = False

    return end


def _trip(code: int, error_register: int, summary: str) -> Effect:
    """Return a fault that the drive reports itself; a fault reset ends it, clearing does not."""

    def begin(target: Target) -> Ending:
        _drive(target).raise_fault(code, error_register)
        return lambda: None

    return Effect(summary=summary, begin=begin)


_DAMAGED: Final = Parameter(
    name="ratio", default=1.0, low=0.001, high=1.0, meaning="share of the frames that are destroyed"
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
        summary="the host's controller is off the bus until cleared", begin=_bus_off
    ),
    (Component.CAN_BUS, Fault.ARBITRATION_LOSS): Effect(
        summary="a babbling node wins every arbitration", begin=_babble
    ),
    (Component.DRIVE, Fault.OFF): Effect(summary="without supply", begin=_off),
    (Component.DRIVE, Fault.OVERHEAT): _trip(
        DRIVE_OVERHEATED, _TEMPERATURE_REGISTER, "reports over-temperature (EMCY 4310h)"
    ),
    (Component.DRIVE, Fault.OVERLOAD): _trip(
        DRIVE_OVERLOADED, _CURRENT_REGISTER, "reports over-current (EMCY 2310h)"
    ),
    (Component.DRIVE, Fault.ID_CLASH): Effect(summary="a second node has its id", begin=_clash),
    (Component.DRIVE, Fault.WRONG_BAUD): Effect(
        summary="at another bit rate than the bus", begin=_mistune
    ),
}
