"""Log why what streams in is refused, now and then: not once for each message."""

import logging
from typing import Final

from drivers.clock import NS_PER_S, Clock

TELL_S: Final = 2.0
_log = logging.getLogger(__name__)


class Refusals:
    """Log refusals of one topic, at most one every `TELL_S`."""

    def __init__(self, topic: str, clock: Clock) -> None:
        self._topic = topic
        self._clock = clock
        self._told_ns: int | None = None

    def note(self, why: str) -> None:
        """Log a refusal, unless one was logged just before."""
        now_ns = self._clock.now_ns()
        if self._told_ns is None or now_ns - self._told_ns > TELL_S * NS_PER_S:
            self._told_ns = now_ns
            _log.warning("%s refused: %s", self._topic, why)
