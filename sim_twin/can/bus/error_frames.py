"""Build the error frames by which SocketCAN tells of its controller, as python-can shows them."""

from typing import Final

import can

from sim_twin.can.bus.error_counters import ErrorCounters, ErrorState

# linux/can/error.h: error classes in the identifier
LOST_ARBITRATION: Final = 0x002
CONTROLLER: Final = 0x004
PROTOCOL: Final = 0x008
NO_ACKNOWLEDGEMENT: Final = 0x020
BUS_OFF: Final = 0x040
BUS_ERROR: Final = 0x080
RESTARTED: Final = 0x100
COUNTERS: Final = 0x200

# data[1], the controller's state
RX_WARNING, TX_WARNING, RX_PASSIVE, TX_PASSIVE, BACK_TO_ACTIVE = 0x04, 0x08, 0x10, 0x20, 0x40
_BY_RECEIVING: Final = {ErrorState.WARNING: RX_WARNING, ErrorState.PASSIVE: RX_PASSIVE}
_BY_TRANSMITTING: Final = {ErrorState.WARNING: TX_WARNING, ErrorState.PASSIVE: TX_PASSIVE}
COUNTER_MAX: Final = 255


def state_frame(counters: ErrorCounters) -> can.Message:
    """Return the frame that tells of a new state."""
    state = counters.state
    if state is ErrorState.BUS_OFF:
        return _error_frame(BUS_OFF, 0, counters)
    if state is ErrorState.ACTIVE:
        return _error_frame(CONTROLLER, BACK_TO_ACTIVE, counters)
    flags = _BY_TRANSMITTING[state] * (counters.tec >= counters.rec)
    flags |= _BY_RECEIVING[state] * (counters.rec >= counters.tec)
    return _error_frame(CONTROLLER, flags, counters)


def restarted_frame(counters: ErrorCounters) -> can.Message:
    """Return the frame that tells of the recovery from bus-off."""
    return _error_frame(RESTARTED | CONTROLLER, BACK_TO_ACTIVE, counters)


def bus_error_frame(error_class: int, counters: ErrorCounters) -> can.Message:
    """Return the frame that tells of one error, for who has asked for each of them."""
    return _error_frame(error_class | BUS_ERROR, 0, counters)


def is_restart(frame: can.Message) -> bool:
    """Return whether an error frame tells of the recovery from bus-off."""
    return bool(frame.is_error_frame and frame.arbitration_id & RESTARTED)


def _error_frame(error_class: int, flags: int, counters: ErrorCounters) -> can.Message:
    told = (min(counters.tec, COUNTER_MAX), min(counters.rec, COUNTER_MAX))
    return can.Message(
        arbitration_id=error_class | COUNTERS,
        is_error_frame=True,
        is_extended_id=False,
        data=bytes((0, flags, 0, 0, 0, 0, *told)),
    )
