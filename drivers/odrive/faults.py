"""Put an axis' errors into words and say who may clear them."""

from dataclasses import dataclass
from typing import Final

from drivers.odrive.codec import AxisError
from drivers.wheel_drives.bus import ResetRule

AUTOMATIC_ERRORS: Final = AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.INITIALIZING
REPAIR_ERRORS: Final = (
    AxisError.SYSTEM_LEVEL
    | AxisError.BAD_CONFIG
    | AxisError.DRV_FAULT
    | AxisError.BRAKE_RESISTOR_DISARMED
    | AxisError.THERMISTOR_DISCONNECTED
    | AxisError.CALIBRATION_ERROR
)


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisFault:
    """Hold the errors that disarmed an axis or keep it from being armed."""

    code: int

    @property
    def text(self) -> str:
        """Return the errors in words."""
        names = [str(bit.name).lower().replace("_", " ") for bit in AxisError if self.code & bit]
        unknown = self.code & ~sum(AxisError)
        names += [f"undocumented bits 0x{unknown:X}"] * bool(unknown)
        return f"0x{self.code:08X} {', '.join(names)}"

    @property
    def rule(self) -> ResetRule:
        """Return who may clear them: the strictest rule of all bits."""
        if self.code & REPAIR_ERRORS:
            return ResetRule.NEVER
        return ResetRule.OPERATOR if self.code & ~int(AUTOMATIC_ERRORS) else ResetRule.AUTOMATIC
