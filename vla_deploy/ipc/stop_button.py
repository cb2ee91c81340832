"""Press the software emergency stop: the one way in for every source, spoken, shown or wired.

A press is an event in shared memory that control reads in its next tick. It needs no planner, no
model, no executor and no network, and nothing here imports any; nor does it wait for a process that
was frozen while it wrote to the same ring.
"""

from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from vla_deploy.ipc import topics
from vla_deploy.ipc.space import SharedSpace

ESTOP: Final = "estop"
REPEAT_NS: Final = NS_PER_S // 10
_REASON_LETTERS: Final = 150  # of any alphabet, a slot holds them
_SOURCE_LETTERS: Final = 50


class StopButton:
    """Press the stop on behalf of one source, whose name control shows."""

    def __init__(self, space: SharedSpace, source: str, clock: Clock | None = None) -> None:
        """Open the operator ring.

        Raises:
            SpaceUnavailable: shared memory cannot be opened.
        """
        self.source = source[:_SOURCE_LETTERS]
        self._clock = clock or MonotonicClock()
        self._out = space.ring_writer(topics.OPERATOR)
        self._in = space.ring_reader(topics.OPERATOR, from_start=True)
        self._newest_act: object = None
        self._newest_ns = 0

    def press(self, reason: str = "") -> bool:
        """Demand an emergency stop; False when one that nothing has followed was just demanded.

        A source that repeats itself, or several at once, so do not push each other out of the ring.
        After any other act, and after a tenth of a second, a press counts again.
        """
        self._look()
        recent = self._clock.now_ns() - self._newest_ns < REPEAT_NS
        if recent and self._newest_act == ESTOP:
            return False
        reason = reason[:_REASON_LETTERS]
        self._out.force({"act": ESTOP, "source": self.source, "reason": reason})
        return True

    def close(self) -> None:
        """Unmap the ring."""
        self._out.close()
        self._in.close()

    def _look(self) -> None:
        for event in self._in.drain():
            self._newest_act, self._newest_ns = event.payload.get("act"), event.stamp_ns
