"""Keep one device connected: a link that breaks is opened again, and its user goes on meanwhile."""

import logging
from collections.abc import Callable
from typing import Final, Generic, Protocol, TypeVar

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError

FIRST_RETRY_NS: Final = NS_PER_S // 4
LONGEST_RETRY_NS: Final = 4 * NS_PER_S
_log = logging.getLogger(__name__)


class Closable(Protocol):
    """Be closable; what a device's `poll` returns is its own."""

    def close(self) -> None:
        """Release the device."""
        ...


D = TypeVar("D", bound=Closable)
R = TypeVar("R")


class Reopening(Generic[D]):
    """Hold a device that may come and go.

    Attempts follow each other at 0.25 s, 0.5 s and so on up to 4 s; each is one call of `connect`,
    made from `poll`. `reconnects` counts how often the device came back, `failure` says why it is
    away and is empty while it is there.
    """

    def __init__(self, name: str, connect: Callable[[], D], clock: Clock) -> None:
        self.reconnects = 0
        self.failure = ""
        self._name = name
        self._connect = connect
        self._clock = clock
        self._device: D | None = None
        self._delay_ns = FIRST_RETRY_NS
        self._retry_ns = 0

    def open(self) -> None:
        """Connect for the first time.

        Raises:
            DriverError: the device is not there; at the start that is a fault of the set-up.
        """
        self._device = self._connect()

    def poll(self, read: Callable[[D], R], nothing: R) -> R:
        """Return what `read` gets, or `nothing` while the device is away; never waits."""
        try:
            if self._device is None and not self._reconnect():
                return nothing
            assert self._device is not None
            value = read(self._device)
        except DriverError as error:
            self._lose(str(error))
            return nothing
        self._delay_ns = FIRST_RETRY_NS
        return value

    def close(self) -> None:
        """Release the device; closing twice is allowed."""
        if self._device is not None:
            self._device.close()
        self._device = None

    def _lose(self, failure: str) -> None:
        if failure != self.failure:
            _log.warning("%s is away, it is tried again: %s", self._name, failure)
        self.failure = failure
        self.close()
        self._retry_ns = self._clock.now_ns() + self._delay_ns
        self._delay_ns = min(2 * self._delay_ns, LONGEST_RETRY_NS)

    def _reconnect(self) -> bool:
        if self._clock.now_ns() < self._retry_ns:
            return False
        self._device = self._connect()
        self.reconnects += 1
        self.failure = ""
        _log.info("%s is back", self._name)
        return True
