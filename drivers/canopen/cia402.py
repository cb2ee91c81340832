"""Read a drive's state from its statusword and choose the controlword that leads to a goal.

The patterns and commands are those of CiA 402-2 (IEC 61800-7-201), state control and statusword.
"""

from enum import IntEnum
from typing import Final

from drivers.wheel_drives.bus import DriveGoal, PowerState


class ControlCommand(IntEnum):
    """Name the controlwords (6040) that drive the state machine."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


STATUSWORD_PATTERNS: Final[tuple[tuple[int, int, PowerState], ...]] = (
    (0x4F, 0x00, PowerState.NOT_READY),
    (0x4F, 0x40, PowerState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, PowerState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, PowerState.SWITCHED_ON),
    (0x6F, 0x27, PowerState.OPERATION_ENABLED),
    (0x6F, 0x07, PowerState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, PowerState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, PowerState.FAULT),
)
FAULT_STATES: Final = (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE)

# Anything not listed gets DISABLE_VOLTAGE, the one command that is safe in every state.
_COMMANDS: Final[dict[tuple[DriveGoal, PowerState], ControlCommand]] = {
    (DriveGoal.ENABLED, PowerState.SWITCH_ON_DISABLED): ControlCommand.SHUTDOWN,
    (DriveGoal.ENABLED, PowerState.READY_TO_SWITCH_ON): ControlCommand.SWITCH_ON,
    (DriveGoal.ENABLED, PowerState.SWITCHED_ON): ControlCommand.ENABLE_OPERATION,
    (DriveGoal.ENABLED, PowerState.OPERATION_ENABLED): ControlCommand.ENABLE_OPERATION,
    (DriveGoal.QUICK_STOP, PowerState.OPERATION_ENABLED): ControlCommand.QUICK_STOP,
    (DriveGoal.QUICK_STOP, PowerState.QUICK_STOP_ACTIVE): ControlCommand.QUICK_STOP,
    (DriveGoal.FAULT_RESET, PowerState.FAULT): ControlCommand.FAULT_RESET,
}


def decode_statusword(statusword: int) -> PowerState:
    """Return the state that a statusword shows; UNKNOWN where the standard has no such pattern."""
    for mask, bits, state in STATUSWORD_PATTERNS:
        if statusword & mask == bits:
            return state
    return PowerState.UNKNOWN


def controlword_for(goal: DriveGoal, state: PowerState) -> ControlCommand:
    """Return the next command on the way from `state` to `goal`."""
    return _COMMANDS.get((goal, state), ControlCommand.DISABLE_VOLTAGE)
