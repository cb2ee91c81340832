"""Group the errors of flights and recordings by what the caller can do about them.

TelemetryError
├── FlightMissing      there is no such file: list what there is
├── FlightUnreadable   the file is cut off, spoiled, or not ours: take another one
├── FlightForeign      it was recorded by a version with other rules: judge it with that one
├── ReplayRefused      a replay cannot do what is asked: ask for something else
├── ExtraMissing       an optional part is not installed, or cannot be served: the text says how
├── RecordingRefused   a recording cannot be made as it was asked for: ask for another
└── SettingsInvalid    recording.toml has faults, all of them are listed: mend the file
"""


class TelemetryError(Exception):
    """Base of everything that flights and recordings raise."""


class FlightMissing(TelemetryError):
    """Say that no such file is in the folder."""


class FlightUnreadable(TelemetryError):
    """Say that a file is no whole flight, or no recording of this project."""


class FlightForeign(TelemetryError):
    """Say that a flight's ticks do not fit the judge of this version."""


class RecordingRefused(TelemetryError):
    """Say why nothing is recorded as it was asked for."""


class ExtraMissing(TelemetryError):
    """Say which optional part is missing, and how to get it."""


class ReplayRefused(TelemetryError):
    """Say what a replay cannot do."""


class SettingsInvalid(TelemetryError):
    """Say everything that is wrong with the settings of recording."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        self.faults = faults
        super().__init__("; ".join(faults))
