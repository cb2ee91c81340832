"""Take the operator's acts: an emergency stop at once, everything else one per tick, in order."""

from collections import deque
from enum import Enum

from vla_deploy.ipc import RingReader


class Act(Enum):
    """Name what a person may ask of control."""

    ESTOP = "estop"
    RESET = "reset"
    ARM = "arm"
    DISARM = "disarm"


class OperatorDesk:
    """Drain the operator ring."""

    def __init__(self, ring: RingReader) -> None:
        self._ring = ring
        self._waiting: deque[Act] = deque()
        self.estop_source: str | None = None
        self.complaint = ""

    def listen(self) -> None:
        """Take in what has come; `estop_source` is set for this tick only.

        An emergency stop drops the acts that came before it; events that were lost to a full ring
        may have held one, so they count as one.
        """
        lost_before = self._ring.lost
        self.estop_source = None
        for event in self._ring.drain():
            self._take(event.payload.get("act"), str(event.payload.get("source", "unknown")))
        if self._ring.lost > lost_before:
            self._stop("operator events were lost")

    def next_act(self) -> Act | None:
        """Return the next act other than an emergency stop."""
        return self._waiting.popleft() if self._waiting else None

    def _take(self, name: object, source: str) -> None:
        try:
            act = Act(name)
        except ValueError:
            allowed = ", ".join(a.value for a in Act)
            self.complaint = f"operator act {name!r} from {source}: expected one of {allowed}"
            return
        if act is Act.ESTOP:
            self._stop(source)
        else:
            self._waiting.append(act)

    def _stop(self, source: str) -> None:
        self.estop_source = source
        self._waiting.clear()
