"""Run the device side of the CiA 402-2 power drive state machine as a table."""

from enum import Enum
from typing import Final

from drivers.wheel_drives.bus import PowerState


class ControlwordCommand(Enum):
    """Name what a controlword asks for (CiA 402-2, command coding)."""

    DISABLE_VOLTAGE = "disable voltage"
    QUICK_STOP = "quick stop"
    SHUTDOWN = "shutdown"
    SWITCH_ON = "switch on"
    ENABLE_OPERATION = "enable operation"


# (mask, bits, command) in the order of the standard's table; bit 7 is judged apart, by its edge.
_COMMAND_PATTERNS: Final = (
    (0b0010, 0b0000, ControlwordCommand.DISABLE_VOLTAGE),
    (0b0110, 0b0010, ControlwordCommand.QUICK_STOP),
    (0b0111, 0b0110, ControlwordCommand.SHUTDOWN),
    (0b1111, 0b0111, ControlwordCommand.SWITCH_ON),
    (0b1111, 0b1111, ControlwordCommand.ENABLE_OPERATION),
)
FAULT_RESET_BIT: Final = 0x80

_S = PowerState
_C = ControlwordCommand
# Transition numbers are those of the standard.
TRANSITIONS: Final[dict[tuple[PowerState, ControlwordCommand], PowerState]] = {
    (_S.SWITCH_ON_DISABLED, _C.SHUTDOWN): _S.READY_TO_SWITCH_ON,  # 2
    (_S.READY_TO_SWITCH_ON, _C.SWITCH_ON): _S.SWITCHED_ON,  # 3
    (_S.READY_TO_SWITCH_ON, _C.ENABLE_OPERATION): _S.OPERATION_ENABLED,  # 3 and 4
    (_S.READY_TO_SWITCH_ON, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 7
    (_S.READY_TO_SWITCH_ON, _C.QUICK_STOP): _S.SWITCH_ON_DISABLED,  # 7
    (_S.SWITCHED_ON, _C.ENABLE_OPERATION): _S.OPERATION_ENABLED,  # 4
    (_S.SWITCHED_ON, _C.SHUTDOWN): _S.READY_TO_SWITCH_ON,  # 6
    (_S.SWITCHED_ON, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 10
    (_S.SWITCHED_ON, _C.QUICK_STOP): _S.SWITCH_ON_DISABLED,  # 10
    (_S.OPERATION_ENABLED, _C.SWITCH_ON): _S.SWITCHED_ON,  # 5
    (_S.OPERATION_ENABLED, _C.SHUTDOWN): _S.READY_TO_SWITCH_ON,  # 8
    (_S.OPERATION_ENABLED, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 9
    (_S.OPERATION_ENABLED, _C.QUICK_STOP): _S.QUICK_STOP_ACTIVE,  # 11
    (_S.QUICK_STOP_ACTIVE, _C.DISABLE_VOLTAGE): _S.SWITCH_ON_DISABLED,  # 12
}
STATE_BITS: Final[dict[PowerState, int]] = {
    _S.NOT_READY: 0x00,
    _S.SWITCH_ON_DISABLED: 0x40,
    _S.READY_TO_SWITCH_ON: 0x21,
    _S.SWITCHED_ON: 0x33,
    _S.OPERATION_ENABLED: 0x37,
    _S.QUICK_STOP_ACTIVE: 0x17,
    _S.FAULT_REACTION_ACTIVE: 0x1F,
    _S.FAULT: 0x08,
}
POWERED: Final = (_S.OPERATION_ENABLED, _S.QUICK_STOP_ACTIVE, _S.FAULT_REACTION_ACTIVE)

DISABLE_AT_ONCE: Final = 0
RAMP_OPTIONS: Final = (0, 1, 2, 5, 6)
STAYING_OPTIONS: Final = (5, 6)


def decode_command(controlword: int) -> ControlwordCommand | None:
    """Return what a controlword asks for."""
    for mask, bits, command in _COMMAND_PATTERNS:
        if controlword & mask == bits:
            return command
    return None


class PowerStateMachine:
    """Hold the power state; controlwords, faults and standstill move it."""

    def __init__(self) -> None:
        self.state = PowerState.NOT_READY
        self._reset_bit = False

    @property
    def powered(self) -> bool:
        """Return whether the motor produces torque."""
        return self.state in POWERED

    def initialise(self) -> None:
        """Pass the self-test: transitions 0 and 1."""
        self.state = PowerState.SWITCH_ON_DISABLED
        self._reset_bit = False

    def command(self, controlword: int, quick_stop_option: int) -> bool:
        """Follow a controlword; tell whether it took back a fault."""
        reset_bit = bool(controlword & FAULT_RESET_BIT)
        rising, self._reset_bit = reset_bit and not self._reset_bit, reset_bit
        if self.state is PowerState.FAULT:
            if rising:
                self.state = PowerState.SWITCH_ON_DISABLED  # 15
            return rising
        command = decode_command(controlword)
        if command is ControlwordCommand.QUICK_STOP and self.state is PowerState.OPERATION_ENABLED:
            self.quick_stop(quick_stop_option)
        elif (
            command is ControlwordCommand.ENABLE_OPERATION
            and self.state is PowerState.QUICK_STOP_ACTIVE
        ):
            self._leave_quick_stop(quick_stop_option)
        elif command is not None:
            self.state = TRANSITIONS.get((self.state, command), self.state)
        return False

    def quick_stop(self, option: int) -> None:
        """Brake, or take the power off where the option says so."""
        if self.state is not PowerState.OPERATION_ENABLED:
            return
        at_once = option == DISABLE_AT_ONCE
        self.state = (
            PowerState.SWITCH_ON_DISABLED if at_once else PowerState.QUICK_STOP_ACTIVE  # 11
        )

    def _leave_quick_stop(self, option: int) -> None:
        if option in STAYING_OPTIONS:
            self.state = PowerState.OPERATION_ENABLED  # 16

    def disable(self) -> None:
        """Take the power off without a fault."""
        if self.state not in (PowerState.FAULT, PowerState.FAULT_REACTION_ACTIVE):
            self.state = PowerState.SWITCH_ON_DISABLED

    def fail(self, reaction_option: int) -> None:
        """Enter the fault reaction, or FAULT where nothing moves or the option says so."""
        brakes = self.powered and reaction_option != DISABLE_AT_ONCE
        self.state = PowerState.FAULT_REACTION_ACTIVE if brakes else PowerState.FAULT  # 13

    def at_standstill(self, quick_stop_option: int) -> None:
        """End a braking state."""
        if self.state is PowerState.FAULT_REACTION_ACTIVE:
            self.state = PowerState.FAULT  # 14
        elif (
            self.state is PowerState.QUICK_STOP_ACTIVE and quick_stop_option not in STAYING_OPTIONS
        ):
            self.state = PowerState.SWITCH_ON_DISABLED  # 12
