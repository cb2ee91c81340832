"""Group what the twin refuses to do.

TwinError
├── OpenGLMissing      nothing can be rendered here: install the named packages
├── TwinModelMismatch  robot file and world do not fit together: fix the named file
├── RefereeRefusal     the referee does not know the object, container or operation
├── FilmFault          a film cannot be written: choose another path or ending
├── FaultRefused       the fault is unknown, not supported there, or out of range: see what is
├── DrawingFailed      the camera's or the window's process did not start: the message says why
└── TwinUnreachable    no twin answers under the run directory: start one
"""


class TwinError(Exception):
    """Base of everything the twin raises."""


class OpenGLMissing(TwinError):
    """Say that nothing can be rendered on this machine, and how to change that."""


class TwinModelMismatch(TwinError):
    """Say that the robot or the world lacks a part that the twin needs."""


class RefereeRefusal(TwinError):
    """Say why the referee cannot answer."""


class TwinUnreachable(TwinError):
    """Say that no twin answers."""


class FaultRefused(TwinError):
    """Say why a fault cannot be injected."""


class FilmFault(TwinError):
    """Say why a film cannot be written."""


class DrawingFailed(TwinError):
    """Say why a process that draws did not start."""
