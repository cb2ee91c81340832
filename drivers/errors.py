"""Group driver errors by what the caller can do about them.

DriverError
├── DeviceMissing    the path or interface is not there: fix the wiring or the robot file
├── DeviceBusy       another process holds it: stop that process
├── LinkLost         it was there and went away: stop, reconnect, re-arm
├── NoReply          a device on a working link stayed silent (also a TimeoutError)
├── ProtocolError    bytes arrived that break the protocol
├── DeviceFault      the device reports a fault of its own
├── WrongDevice      the device is not what the robot file declares
├── UnknownModel     no driver here knows the model: correct the name
└── VoiceError       a text became no sound: the program's own words are in the message
"""


class DriverError(Exception):
    """Base of everything a driver raises."""


class DeviceMissing(DriverError):
    """Say that a device path or interface does not exist."""


class DeviceBusy(DriverError):
    """Say that another process holds the device."""


class LinkLost(DriverError):
    """Say that a link that worked has gone."""


class NoReply(DriverError, TimeoutError):
    """Say that a device on a working link did not answer in time."""


class ProtocolError(DriverError):
    """Say that received bytes break the protocol."""


class DeviceFault(DriverError):
    """Say that the device itself reports a fault."""


class WrongDevice(DriverError):
    """Say that the device found is not the one declared."""


class UnknownModel(DriverError):
    """Say that no driver knows a model."""


class VoiceError(DriverError):
    """Say why a text did not become sound."""
