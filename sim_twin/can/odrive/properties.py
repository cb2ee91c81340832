"""Keep an ODrive's properties, as an endpoint file numbers them, in memory and as saved."""

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from drivers.odrive.endpoints import (
    ENABLE_WATCHDOG,
    ENCODER_RATE,
    HEARTBEAT_RATE,
    WATCHDOG_TIMEOUT,
    EndpointTable,
)

DEFAULTS: Final = {
    HEARTBEAT_RATE: 100.0,
    ENCODER_RATE: 10.0,
    ENABLE_WATCHDOG: 0.0,
    WATCHDOG_TIMEOUT: 0.0,
}
FLOAT_LAYOUT: Final = "<f"


@dataclass(frozen=True, slots=True)
class LiveProperty:
    """Reach a property that lives in another part of the firmware."""

    read: Callable[[], float]
    write: Callable[[float], None]


class ODriveProperties:
    """Read and write properties by name, and by number as the CAN protocol does.

    One that the emulation does not act upon keeps what is written to it.
    """

    def __init__(self, table: EndpointTable, live: Mapping[str, LiveProperty]) -> None:
        self._endpoints = {each.number: each for each in table.endpoints.values()}
        self._live = live
        self._saved: dict[str, float] = dict(DEFAULTS)
        self._values: dict[str, float] = {}
        self.load()

    def load(self) -> None:
        """Return to what is saved, as a restart does."""
        self._values = dict(self._saved)

    def save(self) -> None:
        """Keep the present values through a restart."""
        self._saved = dict(self._values)

    def erase(self) -> None:
        """Forget what was saved."""
        self._saved = dict(DEFAULTS)

    def read(self, name: str) -> float:
        """Return a property; one that was never written is 0."""
        live = self._live.get(name)
        return self._values.get(name, 0.0) if live is None else live.read()

    def write(self, name: str, value: float) -> None:
        """Set a property.

        Raises:
            ValueError: the value is not finite.
        """
        if not math.isfinite(value):
            raise ValueError(f"{name}: {value} is not finite")
        live = self._live.get(name)
        if live is None:
            self._values[name] = value
        else:
            live.write(value)

    def read_number(self, number: int) -> bytes | None:
        """Return a property's four bytes, None where no property has the number."""
        endpoint = self._endpoints.get(number)
        if endpoint is None:
            return None
        value = self.read(endpoint.name)
        is_float = endpoint.layout.format == FLOAT_LAYOUT
        return endpoint.encode(value if is_float else int(value))

    def write_number(self, number: int, data: bytes) -> None:
        """Set a property from its four bytes; a number without property changes nothing.

        Raises:
            ValueError: the value is not finite.
        """
        endpoint = self._endpoints.get(number)
        if endpoint is not None:
            self.write(endpoint.name, endpoint.decode(data))


def firmware_numbers(firmware: str) -> tuple[int, ...]:
    """Return the three numbers of a firmware's version, as Get_Version tells them.

    Raises:
        ValueError: it is not three numbers of one byte each.
    """
    try:
        return tuple(struct.pack("3B", *map(int, firmware.split("."))))
    except (ValueError, struct.error) as error:
        raise ValueError(f"firmware version {firmware!r}: expected three numbers") from error
