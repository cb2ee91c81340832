"""Press the stop button for whoever asks, and count it."""

import logging
from typing import Final

from vla_deploy.ipc import IpcError, StopButton
from vla_deploy.stop_door.request import Request

SOURCE: Final = "page"
_log = logging.getLogger(__name__)


class Pressing:
    """Hold the button; presses that it joins into one count as well."""

    def __init__(self, button: StopButton) -> None:
        self.pressed = 0
        self.joined = 0
        self.failed = 0
        self._button = button

    def press(self, request: Request, peer: str) -> str:
        """Demand the stop, and return why that failed, or nothing.

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
