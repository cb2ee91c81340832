"""Read a normally closed contact on a GPIO line through the kernel's character device.

Wiring: one side of the contact to ground, the other to the line; the line is pulled up. A closed
contact pulls it low. Pressing opens the contact, and so does a broken wire or a pulled plug.
"""

from typing import Any, Final

from drivers.errors import LinkLost
from drivers.gpio import load_gpiod, refused_line

CONSUMER: Final = "vla-deploy e-stop"


class GpioContact:
    """Hold one requested line of a chip such as `/dev/gpiochip0`."""

    def __init__(self, chip: str, offset: int) -> None:
        """Request the line as a pulled-up input.

        Raises:
            DeviceMissing: gpiod is not installed, or there is no such chip or line.
            DeviceBusy: another process holds the line.
        """
        self._where = f"{chip} line {offset}"
        self._offset = offset
        gpiod = load_gpiod("an e-stop")
        line = gpiod.line
        settings = gpiod.LineSettings(
            direction=line.Direction.INPUT, bias=line.Bias.PULL_UP, active_low=True
        )
        self._active = line.Value.ACTIVE
        self._gone = (OSError, gpiod.RequestReleasedError)
        try:
            self._request: Any = gpiod.request_lines(
                chip, consumer=CONSUMER, config={offset: settings}
            )
        except (OSError, ValueError) as error:
            raise refused_line(self._where, error) from error

    def is_closed(self) -> bool:
        """Return whether the contact is closed, that is, the button released and the wire whole.

        Raises:
            LinkLost: the chip has gone.
        """
        try:
            return bool(self._request.get_value(self._offset) == self._active)
        except self._gone as error:
            raise LinkLost(f"{self._where}: {error}; plug the GPIO adapter in again") from error

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        request, self._request = self._request, None
        if request is not None:
            request.release()
