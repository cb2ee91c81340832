"""Group the errors of recorded flights by what the caller can do about them.

TelemetryError
├── FlightMissing      there is no such file: list what there is
├── FlightUnreadable   the file is cut off, spoiled, or not ours: take another one
└── FlightForeign      it was recorded by a version with other rules: judge it with that one
"""


class TelemetryError(Exception):
    """Base of everything that recorded flights raise."""


class FlightMissing(TelemetryError):
    """Say that no such flight is in the folder."""


class FlightUnreadable(TelemetryError):
    """Say that a file is no whole flight."""


class FlightForeign(TelemetryError):
    """Say that a flight's ticks do not fit the judge of this version."""
