"""Drive a GPIO line through the kernel's character device, and load libgpiod where it is used."""

from importlib import import_module
from types import ModuleType
from typing import Any, Final

from drivers.errors import DeviceBusy, DeviceMissing, LinkLost

_OUTPUT: Final = "vla-deploy output"
_EBUSY: Final = 16


def load_gpiod(what: str) -> ModuleType:
    """Return the library; `what` needs it, in the message.

    Raises:
        DeviceMissing: it is not installed.
    """
    try:
        return import_module("gpiod")
    except ImportError as error:
        raise DeviceMissing(
            f"{what} on GPIO needs the package gpiod: pip install 'vla-deploy[gpio]'"
        ) from error


def refused_line(where: str, error: Exception) -> DeviceMissing | DeviceBusy:
    """Return why the kernel did not hand out a line, and what to do."""
    if isinstance(error, OSError) and error.errno == _EBUSY:
        return DeviceBusy(f"{where}: busy; see who holds it with `gpioinfo`")
    remedy = "see `gpiodetect` and `gpioinfo`, or correct chip and line in the robot file"
    if isinstance(error, PermissionError):
        remedy = "add the user to the group gpio and log in again"
    return DeviceMissing(f"{where}: {error}; {remedy}")


class GpioOutput:
    """Hold one requested line of a chip such as `/dev/gpiochip0` as an output."""

    def __init__(self, chip: str, offset: int, *, active_low: bool) -> None:
        """Request the line at the level that it has: opening switches nothing.

        Raises:
            DeviceMissing: gpiod is not installed, or there is no such chip or line.
            DeviceBusy: another process holds the line.
        """
        self._where = f"{chip} line {offset}"
        self._offset = offset
        gpiod = load_gpiod("a relay")
        self._line = gpiod.line
        self._active_low = active_low
        self._settings = gpiod.LineSettings
        self._gone = (OSError, gpiod.RequestReleasedError)
        as_is = gpiod.LineSettings(direction=gpiod.line.Direction.AS_IS, active_low=active_low)
        self._request: Any = None
        try:
            self._request = gpiod.request_lines(chip, consumer=_OUTPUT, config={offset: as_is})
            self._become_output(self._request.get_value(offset))
        except (OSError, ValueError) as error:
            self.close()
            raise refused_line(self._where, error) from error

    def drive(self, active: bool) -> None:
        """Drive the line.

        Raises:
            LinkLost: the chip has gone.
        """
        value = self._line.Value.ACTIVE if active else self._line.Value.INACTIVE
        try:
            self._request.set_value(self._offset, value)
        except self._gone as error:
            raise self._lost(error) from error

    def is_driven(self) -> bool:
        """Return whether the line has its active level.

        Raises:
            LinkLost: the chip has gone.
        """
        try:
            return bool(self._request.get_value(self._offset) == self._line.Value.ACTIVE)
        except self._gone as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        request, self._request = self._request, None
        if request is not None:
            request.release()

    def _become_output(self, value: Any) -> None:
        settings = self._settings(
            direction=self._line.Direction.OUTPUT, active_low=self._active_low, output_value=value
        )
        self._request.reconfigure_lines(config={self._offset: settings})

    def _lost(self, error: Exception) -> LinkLost:
        return LinkLost(f"{self._where}: {error}; plug the GPIO adapter in again")
