"""Answer the clients' requests: press the stop button, and report what control publishes."""

import logging
from http import HTTPStatus
from typing import Final

from drivers.clock import Clock
from vla_deploy.ipc import IpcError, SharedSpace, StopButton, topics
from vla_deploy.stop_door.http_messages import (
    ControlState,
    Malformed,
    StopRequest,
    not_pressed,
    other_answer,
    pressed,
    read_head,
    refused,
)
from vla_deploy.stop_door.server import MAX_HEAD_BYTES, READ_NS, Responder

SOURCE: Final = "page"
_STATUS_AGE_S: Final = 1.0
_CUT_OFF: Final = (
    f"the head of the request was cut off: expected at most {MAX_HEAD_BYTES} bytes within "
    f"{READ_NS / 1e9:g} s"
)
_log = logging.getLogger(__name__)


class StopHandler:
    """Answer the requests of all clients, and count what came of them.

    `joined` presses were merged into one that was pressed just before.
    """

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self.pressed = 0
        self.joined = 0
        self.failed = 0
        self.refused = 0
        self._button = StopButton(space, SOURCE, clock)
        self._clock = clock
        self._status = space.cell_reader(topics.CONTROL_STATUS)

    def responder(self, peer: str) -> Responder:
        """Return what answers the client at an address."""
        return lambda head, whole: self._answer(head, peer, whole=whole)

    def _answer(self, head: bytes, peer: str, *, whole: bool) -> bytes:
        """Press as soon as the first line says so; refuse other requests that are cut off."""
        try:
            request = read_head(head)
        except Malformed as error:
            return self._refuse(str(error))
        if request.is_press:
            why_not = self._press(request, peer)
            if why_not:
                return not_pressed(request, why_not)
            return pressed(request, self._control_state())
        return other_answer(request, self._control_state()) if whole else self._refuse(_CUT_OFF)

    def _press(self, request: StopRequest, peer: str) -> str:
        """Press the button, and return why that failed, or "".

        A flood becomes ten events a second, so it drives no other operator's act out of the ring.
        """
        reason = f"stop door, from {peer}"
        if request.foreign_origin:
            reason += f", by a page of {request.foreign_origin[:80]}"
        try:
            fresh = self._button.press(reason)
        except (IpcError, OSError) as error:
            self.failed += 1
            _log.error("the stop asked for by %s failed: %s", peer, error)
            return f"the press did not reach shared memory: {error}"
        self.pressed += fresh
        self.joined += not fresh
        if fresh:
            _log.warning("stop pressed: %s", reason)
        return ""

    def _control_state(self) -> ControlState | None:
        """Return what control published within the last second, None where it is silent."""
        sample = self._status.latest()
        if sample is None or (age_s := sample.age_s(self._clock.now_ns())) > _STATUS_AGE_S:
            return None
        try:
            status = sample.document()
            state, latched = str(status["state"]), bool(status["estop_latched"])
        except (KeyError, TypeError, ValueError):
            return None  # of another version: for the user as good as silent
        return ControlState(state=state, estop_latched=latched, age_s=round(max(age_s, 0.0), 3))

    def _refuse(self, why: str) -> bytes:
        self.refused += 1
        return refused(HTTPStatus.BAD_REQUEST, why)
