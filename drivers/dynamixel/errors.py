"""Name what only a Dynamixel says, beneath the errors of all servo buses.

DeviceFault
└── WatchdogTripped      the bus was silent too long; goals are refused until it is cleared
Rejected
├── RejectedResult, RejectedInstruction, RejectedCrc
├── RejectedRange        data range: also every goal while the Bus Watchdog is tripped
├── RejectedLength, RejectedLimit
└── RejectedAccess       read-only, undefined, or EEPROM while torque is on
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from drivers.dynamixel.wire.codec import StatusError
from drivers.errors import DeviceFault
from drivers.servo.errors import Rejected


class WatchdogTripped(DeviceFault):
    """Say that servos stopped by themselves because the bus was silent."""


class RejectedResult(Rejected):
    """Say that the servo failed to do it."""


class RejectedInstruction(Rejected):
    """Say that the servo does not know the instruction."""


class RejectedCrc(Rejected):
    """Say that the request reached the servo damaged."""


class RejectedRange(Rejected):
    """Say that the value is out of range, or the Bus Watchdog is tripped."""


class RejectedLength(Rejected):
    """Say that fewer bytes were sent than the register has."""


class RejectedLimit(Rejected):
    """Say that the value is beyond a limit register."""


class RejectedAccess(Rejected):
    """Say that the register is read-only, undefined, or locked while torque is on."""


REJECTIONS: Final[Mapping[int, tuple[type[Rejected], str]]] = MappingProxyType(
    {
        StatusError.RESULT_FAIL: (RejectedResult, "the servo could not carry it out"),
        StatusError.INSTRUCTION: (RejectedInstruction, "update the servo's firmware"),
        StatusError.CRC: (RejectedCrc, "check cable, termination and baud rate"),
        StatusError.DATA_RANGE: (
            RejectedRange,
            "keep the value in the register's range; clear the Bus Watchdog if it has tripped",
        ),
        StatusError.DATA_LENGTH: (RejectedLength, "send all bytes of the register"),
        StatusError.DATA_LIMIT: (RejectedLimit, "keep the value within the limit registers"),
        StatusError.ACCESS: (
            RejectedAccess,
            "write read-write registers only, and EEPROM only while torque is off",
        ),
    }
)
"""Exception and remedy by the number in a status packet."""
