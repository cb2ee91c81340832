"""Name what goes wrong on a servo bus of any family, beneath the driver errors.

DriverError
├── NoReply
│   └── ServoSilent          a servo, or several, did not answer
├── ProtocolError
│   └── CorruptReply         an answer came, its check sum or length was wrong
├── WrongDevice
│   ├── WrongServo           model, firmware or a persistent setting is not what the robot file says
│   └── SlowAdapter          the adapter holds back what it receives
├── DeviceFault
│   └── ServoFault           the servo reports a hardware error
└── Rejected                 the servo understood and refused
    └── NotKept              written, and a servo still holds another value
"""

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


class Rejected(DriverError):
    """Say that a servo refused an instruction."""


class NotKept(Rejected):
    """Say which servos hold another value than was written."""
