"""Switch a relay on a GPIO line, and read the line back."""

from collections.abc import Callable

from drivers.errors import DriverError
from drivers.gpio import GpioOutput
from vla_deploy.devices.errors import DeviceAway
from vla_deploy.devices.transport import DeviceReading
from vla_deploy.robots.home_devices import GpioLine


class GpioLink:
    """Hold one line as an output; opening it does not change its level."""

    called = ""
    look_period_s = 1.0

    def __init__(self, line: GpioLine) -> None:
        self.where = f"{line.chip} line {line.line}"
        self._line = line
        self._output: GpioOutput | None = None

    def switch(self, on: bool) -> DeviceReading:
        """Drive the line and return its level.

        Raises:
            DeviceAway: the chip is not there, or has gone.
        """
        return self._done(lambda output: output.drive(on))

    def read(self) -> DeviceReading:
        """Return the line's level.

        Raises:
            DeviceAway: the chip is not there, or has gone.
        """
        return self._done(lambda output: None)

    def interrupt(self) -> None:
        """Do nothing: nothing here waits."""

    def close(self) -> None:
        """Release the line, which keeps its level on most chips."""
        output, self._output = self._output, None
        if output is not None:
            output.close()

    def _done(self, act: Callable[[GpioOutput], None]) -> DeviceReading:
        try:
            if self._output is None:
                line = self._line
                self._output = GpioOutput(line.chip, line.line, active_low=line.active_low)
            act(self._output)
            return DeviceReading(is_on=self._output.is_driven())
        except DriverError as error:
            self.close()
            raise DeviceAway(str(error)) from error
