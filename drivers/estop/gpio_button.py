"""Drive an emergency-stop button whose normally closed contact is wired to a GPIO line."""

from typing import Final, Protocol

from drivers.clock import Clock
from drivers.errors import LinkLost
from drivers.estop.base import ButtonState, EstopCounters, EstopReading

DEBOUNCE_NS: Final = 50_000_000


class Contact(Protocol):
    """Be a contact that is closed while the button is released and the wire whole."""

    def is_closed(self) -> bool:
        """Return whether it is closed.

        Raises:
            LinkLost: it cannot be read any more.
        """
        ...

    def close(self) -> None:
        """Release the line; closing twice is allowed."""
        ...


class GpioButton:
    """Believe an open contact at once, a closed one only when it has stayed closed for 50 ms."""

    def __init__(self, contact: Contact, clock: Clock) -> None:
        self.counters = EstopCounters()
        self._contact = contact
        self._clock = clock
        self._state = ButtonState.UNKNOWN
        self._reason = "the contact has not been closed for 50 ms yet"
        self._closed_since_ns: int | None = None

    def poll(self) -> EstopReading:
        """Return what the contact says now; once LOST it stays so until it is opened again."""
        now_ns = self._clock.now_ns()
        if self._state is not ButtonState.LOST:
            try:
                self._judge(self._contact.is_closed(), now_ns)
            except LinkLost as error:
                self.counters.losses += 1
                self._state, self._reason = ButtonState.LOST, str(error)
        return EstopReading(state=self._state, stamp_ns=now_ns, reason=self._reason)

    def close(self) -> None:
        """Release the contact; closing twice is allowed."""
        self._contact.close()

    def _judge(self, is_closed: bool, now_ns: int) -> None:
        if not is_closed:
            self.counters.presses += self._state is not ButtonState.PRESSED
            self._closed_since_ns = None
            self._state, self._reason = ButtonState.PRESSED, "pressed, or its wire is broken"
            return
        if self._closed_since_ns is None:
            self._closed_since_ns = now_ns
        if now_ns - self._closed_since_ns >= DEBOUNCE_NS:
            self.counters.releases += self._state is ButtonState.PRESSED
            self._state, self._reason = ButtonState.RELEASED, ""
