"""Take the operator's acts: an emergency stop at once, everything else one per tick, in order."""

from collections import deque
from collections.abc import Callable
from enum import Enum

from vla_deploy.ipc import RingReader, Sample
from vla_deploy.ipc.payloads.motion import ControlStatus, OperatorRequest

UNKNOWN = "unknown"
LOST = "operator events were lost"
LATCHED_BEFORE = "latched before control was restarted"
MOST_WAITING = 8


class OperatorAct(Enum):
    """Name what a person may ask of control."""

    ESTOP = "estop"
    RESET = "reset"
    ARM = "arm"
    DISARM = "disarm"


class OperatorInbox:
    """Drain the operator ring, and look at the robot's own button.

    `button` names the button as the source of a stop for as long as it is pressed. `last_status` is
    what control told before it was restarted: a latch that it had, and what was pressed since,
    outlive it. Other acts that nobody heard are dropped.
    """

    def __init__(
        self,
        ring: RingReader[OperatorRequest],
        button: Callable[[], str | None] = lambda: None,
        last_status: Sample[ControlStatus] | None = None,
    ) -> None:
        self._ring = ring
        self._button = button
        self._was_pressed = False
        self._waiting: deque[OperatorAct] = deque()
        self.estop_source: str | None = None
        self.complaint = ""
        self._recalled = self._recall(last_status)

    def listen(self) -> None:
        """Take in what has come; `estop_source` is set for this tick only.

        An emergency stop drops the acts that came before it; events that were lost to a full ring,
        or are damaged, may have held one, so they count as one.
        """
        missed_before = self._ring.lost + self._ring.torn
        self.estop_source, self._recalled = self._recalled, None
        for event in self._ring.drain():
            self._take(event.payload.get("act"), str(event.payload.get("source", UNKNOWN)))
        if self._ring.lost + self._ring.torn > missed_before:
            self._stop(LOST)
        self._look_at_button()

    def next_act(self) -> OperatorAct | None:
        """Return the next act other than an emergency stop."""
        return self._waiting.popleft() if self._waiting else None

    def _recall(self, last_status: Sample[ControlStatus] | None) -> str | None:
        """Return who asked for a stop that no control has seen to its end."""
        told_ns = -1 if last_status is None else last_status.stamp_ns
        held = self._ring.drain()
        since = [event for event in held if event.stamp_ns > told_ns]
        pressed = [event for event in since if event.payload.get("act") == OperatorAct.ESTOP.value]
        if pressed:
            return str(pressed[-1].payload.get("source", UNKNOWN))
        if self._ring.lost and since and since[0] is held[0]:
            return LOST
        latched = last_status is not None and last_status.document().get("estop_latched")
        return LATCHED_BEFORE if latched else None

    def _take(self, name: object, source: str) -> None:
        try:
            act = OperatorAct(name)
        except ValueError:
            allowed = ", ".join(a.value for a in OperatorAct)
            self.complaint = f"operator act {name!r} from {source}: expected one of {allowed}"
            return
        if act is OperatorAct.ESTOP:
            self._stop(source)
        elif len(self._waiting) < MOST_WAITING:
            self._waiting.append(act)
        else:
            self.complaint = f"{name} from {source} was dropped: {MOST_WAITING} acts wait already"

    def _look_at_button(self) -> None:
        """Stop as long as the button is pressed; only the press itself drops the waiting acts."""
        source = self._button()
        if source is not None and not self._was_pressed:
            self._stop(source)
        self._was_pressed = source is not None
        self.estop_source = self.estop_source or source

    def _stop(self, source: str) -> None:
        self.estop_source = source
        self._waiting.clear()
