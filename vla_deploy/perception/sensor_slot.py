"""Keep one sensor connected: a link that breaks is opened again, and everybody else goes on."""

import logging
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError

RETRY_NS = NS_PER_S
_log = logging.getLogger(__name__)


class Sensor(Protocol):
    """Be closable; what `poll` returns is each sensor's own."""

    def close(self) -> None:
        """Release the device."""
        ...


S = TypeVar("S", bound=Sensor)
R = TypeVar("R")


class SensorSlot(Generic[S]):
    """Hold a sensor that may come and go; `reconnects` counts how often it came back."""

    def __init__(self, name: str, connect: Callable[[], S], clock: Clock) -> None:
        self.reconnects = 0
        self._name = name
        self._connect = connect
        self._clock = clock
        self._sensor: S | None = None
        self._retry_ns = 0

    def open(self) -> None:
        """Connect for the first time.

        Raises:
            DriverError: the device is not there; at the start that is a fault of the set-up.
        """
        self._sensor = self._connect()

    def poll(self, read: Callable[[S], R], nothing: R) -> R:
        """Return what `read` gets, or `nothing` while the sensor is away."""
        try:
            sensor = self._sensor or self._reconnect()
            return read(sensor) if sensor is not None else nothing
        except DriverError as error:
            _log.warning("%s lost, trying again every second: %s", self._name, error)
            self.close()
            self._retry_ns = self._clock.now_ns() + RETRY_NS
            return nothing

    def close(self) -> None:
        """Release the sensor; closing twice is allowed."""
        if self._sensor is not None:
            self._sensor.close()
        self._sensor = None

    def _reconnect(self) -> S | None:
        if self._clock.now_ns() < self._retry_ns:
            return None
        self._sensor = self._connect()
        self.reconnects += 1
        _log.info("%s is back", self._name)
        return self._sensor
