"""Group the errors of flights, recordings and the history by what the caller can do.

TelemetryError
├── FlightMissing             there is no such file: list what there is
├── FlightUnreadable          the file is cut off, spoiled, or not ours: take another one
├── FlightForeign             a version with other rules recorded it: judge it with that one
├── ReplayRefused             a replay cannot do what is requested: request something else
├── ExtraMissing              an optional part is missing: the text says how to get it
├── RecordingRefused          a recording cannot be made as requested: request another
├── DatasetRefused            a dataset cannot be written as requested: request another
├── DatasetUnusable           a dataset cannot be read: mend it, or take another
├── RecordingSettingsInvalid  recording.toml has faults, all of them are listed: mend the file
├── TrendsUnavailable         the files of the history cannot be made: make room, or mend the folder
└── SeriesUnknown             the history has no such series: list those it has
"""


class TelemetryError(Exception):
    """Base of everything that flights, recordings and the history raise."""


class FlightMissing(TelemetryError):
    """No such file is in the folder."""


class FlightUnreadable(TelemetryError):
    """A file is no whole flight, or no recording of this project."""


class FlightForeign(TelemetryError):
    """A flight's ticks do not fit the safety rules of this version."""


class RecordingRefused(TelemetryError):
    """A recording cannot be made as requested."""


class DatasetRefused(TelemetryError):
    """A dataset cannot be written as requested."""


class DatasetUnusable(TelemetryError):
    """A dataset cannot be read."""


class ExtraMissing(TelemetryError):
    """An optional part is missing; the text says how to get it."""


class ReplayRefused(TelemetryError):
    """A replay cannot do what was requested."""


class RecordingSettingsInvalid(TelemetryError):
    """The settings have faults; all of them are listed."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        self.faults = faults
        super().__init__("; ".join(faults))


class TrendsUnavailable(TelemetryError):
    """The files of the history cannot be made or opened."""


class SeriesUnknown(TelemetryError):
    """The history has no such series."""
