"""Keep an emergency-stop input connected; while it is away, it reads as pressed."""

from collections.abc import Callable

from drivers.clock import Clock
from drivers.errors import LinkLost
from drivers.estop.base import ButtonState, EstopCounters, EstopInput, EstopReading
from drivers.reopening import Reopening


class ReopeningEstop:
    """Open a lost button again, with growing pauses; keep `EstopInput` meanwhile."""

    def __init__(self, connect: Callable[[], EstopInput], clock: Clock) -> None:
        """Connect for the first time.

        Raises:
            DriverError: the button is not there; at the start that is a fault of the set-up.
        """
        self.counters = EstopCounters()
        self._clock = clock
        self._slot: Reopening[EstopInput] = Reopening("e-stop button", connect, clock)
        self._slot.open()

    def poll(self) -> EstopReading:
        """Return what the button says now, or why it is away."""
        reading = self._slot.poll(self._read, None)
        if reading is not None:
            return reading
        return EstopReading(
            state=ButtonState.LOST, stamp_ns=self._clock.now_ns(), reason=self._slot.failure
        )

    def close(self) -> None:
        """Release the button; closing twice is allowed."""
        self._slot.close()

    def _read(self, button: EstopInput) -> EstopReading:
        reading = button.poll()
        self.counters = button.counters
        if reading.state is ButtonState.LOST:
            raise LinkLost(reading.reason)
        return reading
