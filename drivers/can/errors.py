"""Read SocketCAN's error frames: what the CAN controller says about itself and about the bus.

The classes and bits are those of linux/can/error.h; other interfaces that send error frames use
the same ones.
"""

from enum import Enum
from typing import Final

import can

from drivers.errors import LinkLost

_LOST_ARBITRATION, _CONTROLLER, _NO_ACK, _BUS_OFF, _RESTARTED = 0x02, 0x04, 0x20, 0x40, 0x100
_CONTROLLER_BYTE: Final = 1

CLASS_TEXTS: Final[dict[int, str]] = {
    0x01: "transmit timeout",
    _LOST_ARBITRATION: "lost arbitration",
    _CONTROLLER: "controller state",
    0x08: "protocol violation",
    0x10: "transceiver fault",
    _NO_ACK: "no acknowledgement",
    _BUS_OFF: "bus-off",
    0x80: "bus error",
    _RESTARTED: "controller restarted",
}


class ControllerState(Enum):
    """Name the error states of a CAN controller (ISO 11898-1, fault confinement)."""

    ACTIVE = "error active"
    WARNING = "error warning"
    PASSIVE = "error passive"
    BUS_OFF = "bus-off"


# Bits of the controller byte, worst first: passive by sending or receiving, warning, active again.
_STATE_BITS: Final = (
    (0x30, ControllerState.PASSIVE),
    (0x0C, ControllerState.WARNING),
    (0x40, ControllerState.ACTIVE),
)


class BusOff(LinkLost):
    """Say that the CAN controller has left the bus because too many of its frames failed."""


class ControllerWatch:
    """Follow the controller's state and count what the error frames report."""

    def __init__(self) -> None:
        self.state = ControllerState.ACTIVE
        self.counters = {"error_frames": 0, "arbitration_lost": 0, "not_acknowledged": 0}

    def take(self, frame: can.Message) -> None:
        """Take one error frame."""
        classes = frame.arbitration_id
        self.counters["error_frames"] += 1
        self.counters["arbitration_lost"] += bool(classes & _LOST_ARBITRATION)
        self.counters["not_acknowledged"] += bool(classes & _NO_ACK)
        if classes & _CONTROLLER and len(frame.data) > _CONTROLLER_BYTE:
            self.state = _state_of(frame.data[_CONTROLLER_BYTE], self.state)
        if classes & _RESTARTED:
            self.state = ControllerState.ACTIVE
        if classes & _BUS_OFF:
            self.state = ControllerState.BUS_OFF


def _state_of(bits: int, before: ControllerState) -> ControllerState:
    for mask, state in _STATE_BITS:
        if bits & mask:
            return state
    return before


def describe(frame: can.Message) -> str:
    """Return an error frame in words."""
    words = [text for bit, text in CLASS_TEXTS.items() if frame.arbitration_id & bit]
    if frame.arbitration_id & _CONTROLLER and len(frame.data) > _CONTROLLER_BYTE:
        for mask, state in _STATE_BITS:
            if frame.data[_CONTROLLER_BYTE] & mask:
                words.append(state.value)
                break
    return ", ".join(words) or f"unknown error class 0x{frame.arbitration_id:X}"
