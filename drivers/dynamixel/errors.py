"""Name what goes wrong on a servo bus, beneath the driver errors.

DriverError
├── NoReply
│   └── ServoSilent          a servo, or several, did not answer
├── ProtocolError
│   └── CorruptReply         an answer came, its CRC or length was wrong
├── WrongDevice
│   ├── WrongServo           model, firmware or a persistent setting is not what the robot file says
│   └── SlowAdapter          the adapter holds back what it receives
├── DeviceFault
│   ├── ServoFault           the servo reports a hardware error
│   └── WatchdogTripped      the bus was silent too long; goals are refused until it is cleared
└── Rejected                 the servo understood and refused
    ├── RejectedResult, RejectedInstruction, RejectedCrc
    ├── RejectedRange        data range: also every goal while the Bus Watchdog is tripped
    ├── RejectedLength, RejectedLimit
    ├── RejectedAccess       read-only, undefined, or EEPROM while torque is on
    └── NotKept              written to many at once, and a servo still holds another value
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from drivers.dynamixel.wire.codec import StatusError
from drivers.errors import DeviceFault, DriverError, NoReply, ProtocolError, WrongDevice


class ServoSilent(NoReply):
    """Say which servos did not answer."""


class CorruptReply(ProtocolError):
    """Say that an answer came that cannot be trusted."""


class WrongServo(WrongDevice):
    """Say in what a servo differs from the robot file."""


class SlowAdapter(WrongDevice):
    """Say that the adapter holds back received bytes, and how to stop that."""


class ServoFault(DeviceFault):
    """Say which hardware error a servo reports."""


class WatchdogTripped(DeviceFault):
    """Say that servos stopped by themselves because the bus was silent."""


class Rejected(DriverError):
    """Say that a servo refused an instruction."""


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


class NotKept(Rejected):
    """Say which servos hold another value than was written to many at once."""


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
