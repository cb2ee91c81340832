"""Leave a failing server alone for a while, then try it with one request."""

import threading
from enum import StrEnum

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.errors import CircuitOpen


class BreakerState(StrEnum):
    """Say whether requests pass."""

    CLOSED = "closed"
    OPEN = "open"
    HALF_OPEN = "half_open"


class CircuitBreaker:
    """Open after failures in a row; let one request through after a time, which decides."""

    def __init__(self, failures: int, open_s: float, clock: Clock) -> None:
        self._limit = failures
        self._open_ns = round(open_s * NS_PER_S)
        self._clock = clock
        self._lock = threading.Lock()
        self._failures = 0
        self._opened_ns: int | None = None
        self._is_probing = False

    @property
    def state(self) -> BreakerState:
        """Return whether requests pass now."""
        with self._lock:
            if self._opened_ns is None:
                return BreakerState.CLOSED
            return BreakerState.OPEN if self._left_ns() > 0 else BreakerState.HALF_OPEN

    def admit(self) -> None:
        """Let a request pass; `succeeded`, `failed` or `abandoned` must follow.

        Raises:
            CircuitOpen: it is open, or another request is being tried already.
        """
        with self._lock:
            if self._opened_ns is None:
                return
            left_ns = self._left_ns()
            if left_ns > 0 or self._is_probing:
                wait = f"tried again in {left_ns / NS_PER_S:.1f} s" if left_ns > 0 else "on trial"
                raise CircuitOpen(f"left alone after {self._failures} failures in a row; {wait}")
            self._is_probing = True

    def succeeded(self) -> None:
        """Close: the server answers."""
        with self._lock:
            self._failures, self._opened_ns, self._is_probing = 0, None, False

    def failed(self) -> None:
        """Count a failure; open at the limit, and again after a trial that failed."""
        with self._lock:
            self._failures += 1
            if self._is_probing or self._failures >= self._limit:
                self._opened_ns = self._clock.now_ns()
            self._is_probing = False

    def abandoned(self) -> None:
        """Forget a request that says nothing about the server."""
        with self._lock:
            self._is_probing = False

    def _left_ns(self) -> int:
        opened_ns = self._opened_ns or 0
        return opened_ns + self._open_ns - self._clock.now_ns()
