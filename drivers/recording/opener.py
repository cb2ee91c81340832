"""Record every device that is opened, one file per device."""

from pathlib import Path
from typing import Final

import can

from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.errors import DeviceMissing
from drivers.estop.gpio_button import Contact
from drivers.opener import DeviceOpener
from drivers.recording.recorder import RecordingCanBus, RecordingTransport, WireRecorder
from drivers.recording.recording import older_part

RECORD_VARIABLE: Final = "VLA_DEPLOY_RECORD"
"""The environment variable by which a person asks the robot's processes for recordings."""
_KEPT_RECORDINGS: Final = 8


class RecordingOpener:
    """Be a `DeviceOpener` that puts a recorder before each device of another.

    A camera's stream is passed on as it is: its images would fill the recording in a minute. A
    device that is opened again, after a loss or by a restarted process, begins another file.
    """

    def __init__(self, opener: DeviceOpener, directory: Path, clock: Clock) -> None:
        """Record to `<directory>/<device>-<number>.wire`; the newest eight of a device are kept.

        Raises:
            DeviceMissing: the directory cannot be made.
        """
        self._opener = opener
        self._directory = directory
        self._clock = clock
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise DeviceMissing(
                f"cannot record to {directory}: {error.strerror}; choose another directory"
            ) from error

    def serial(self, name: str) -> ByteTransport:
        """Open a serial line and record it.

        Raises:
            DeviceMissing: the device is not there, or the recording cannot be written.
            DeviceBusy: another process holds it.
        """
        return RecordingTransport(self._opener.serial(name), self._recorder(name))

    def stream(self, name: str) -> ByteTransport:
        """Open a byte stream; it is not recorded.

        Raises:
            DeviceMissing: nothing serves the stream.
        """
        return self._opener.stream(name)

    def video(self, name: str) -> ByteTransport | str:
        """Return a video device, or the stream in its place; it is not recorded.

        Raises:
            DeviceMissing: nothing serves the stream.
        """
        return self._opener.video(name)

    def can(self, name: str) -> can.BusABC:
        """Open a CAN bus and record it.

        Raises:
            DeviceMissing: the interface is not there, or the recording cannot be written.
        """
        return RecordingCanBus(self._opener.can(name), self._recorder(name))

    def input_events(self, name: str) -> ByteTransport:
        """Open a source of input events and record it.

        Raises:
            DeviceMissing: the device is not there, or the recording cannot be written.
            DeviceBusy: another process has grabbed it.
        """
        return RecordingTransport(self._opener.input_events(name), self._recorder(name))

    def gpio_contact(self, name: str, offset: int) -> Contact:
        """Open a contact on a GPIO line; it has no bytes to record.

        Raises:
            DeviceMissing: there is no such chip or line.
            DeviceBusy: another process holds the line.
        """
        return self._opener.gpio_contact(name, offset)

    def _recorder(self, name: str) -> WireRecorder:
        earlier = sorted(
            (int(path.stem.rpartition("-")[2]), path)
            for path in self._directory.glob(f"{name}-*.wire")
            if path.stem.rpartition("-")[2].isdecimal()
        )
        for _, path in earlier[: 1 - _KEPT_RECORDINGS]:
            path.unlink(missing_ok=True)
            older_part(path).unlink(missing_ok=True)
        number = earlier[-1][0] + 1 if earlier else 1
        path = self._directory / f"{name}-{number}.wire"
        return WireRecorder(path, self._clock, note=f"device {name}")


def recorded_if_asked(opener: DeviceOpener, clock: Clock, directory: str | None) -> DeviceOpener:
    """Return the opener, with a recorder before each of its devices when a directory is given.

    Raises:
        DeviceMissing: the directory cannot be made.
    """
    return RecordingOpener(opener, Path(directory), clock) if directory else opener
