"""Bound the calls to a server by the minute: what is asked may cost money, heat and patience."""

import threading
from collections import deque

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.errors import Busy

_MINUTE_NS = 60 * NS_PER_S


class CallRate:
    """Let so many calls through in any minute, and refuse the next at once."""

    def __init__(self, per_minute: int, clock: Clock) -> None:
        self._per_minute = per_minute
        self._clock = clock
        self._lock = threading.Lock()
        self._begun_ns: deque[int] = deque()

    def take(self) -> None:
        """Count a call.

        Raises:
            Busy: the last minute had as many as are allowed.
        """
        with self._lock:
            now_ns = self._clock.now_ns()
            while self._begun_ns and now_ns - self._begun_ns[0] >= _MINUTE_NS:
                self._begun_ns.popleft()
            if len(self._begun_ns) >= self._per_minute:
                wait_s = (self._begun_ns[0] + _MINUTE_NS - now_ns) / NS_PER_S
                raise Busy(
                    f"{self._per_minute} calls in the last minute are all that is allowed "
                    f"(max_calls_per_minute); the next one in {wait_s:.0f} s"
                )
            self._begun_ns.append(now_ns)
