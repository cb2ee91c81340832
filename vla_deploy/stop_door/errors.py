"""Tell why the door is closed.

StopDoorError
└── DoorClosed    nobody can come in at the address: the message says what to mend, it is retried
"""


class StopDoorError(Exception):
    """Base of everything that the stop door raises."""


class DoorClosed(StopDoorError):
    """Say why no connection can be taken."""
