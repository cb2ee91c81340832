"""Group what goes wrong with devices of the home by what the caller can do.

DeviceError
├── DeviceAway          it, or its broker, does not answer: a second try may succeed
├── StateUnreadable     it answers, but not what it was declared to: nothing is believed
└── DeviceNotUsable     a person has to mend the robot file, the credentials or the installation

No message holds a password, a key or the query of a URL, and what devices have sent is in it only
without control characters, and cut off.
"""


class DeviceError(Exception):
    """Base of everything by which the state of a device is not known."""


class DeviceAway(DeviceError):
    """Say who did not answer, and what was waited for."""


class StateUnreadable(DeviceError):
    """Say what came instead of a state."""


class DeviceNotUsable(DeviceError):
    """Say what a person has to mend before the device can be used."""
