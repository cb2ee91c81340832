"""Bound what one server is asked: calls at a time, by the minute, after failures, and retries."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.errors import (
    Busy,
    CircuitOpen,
    ModelServerError,
    ServerFailed,
    ServerUnreachable,
    TimedOut,
)
from vla_deploy.runtime.deadline import Deadline

_MINUTE_NS = 60 * NS_PER_S


def bounded_s(deadline: Deadline, wanted_s: float | None = None) -> float:
    """Return the time that one wait may take: what is wanted, at most what is left.

    Raises:
        TimedOut: nothing is left, or it was recalled.
    """
    left_s = deadline.left_s
    if deadline.is_recalled:
        raise TimedOut("nobody waits for the answer any more")
    if left_s <= 0.0:
        raise TimedOut(f"no whole answer within {deadline.given_s:g} s")
    return left_s if wanted_s is None else min(wanted_s, left_s)


class Admission:
    """Bound the calls under way and those that wait."""

    def __init__(self, max_calls: int, max_waiting: int) -> None:
        self._max_calls = max_calls
        self._max_waiting = max_waiting
        self._changed = threading.Condition()
        self._active = 0
        self._waiting: deque[object] = deque()

    @property
    def active(self) -> int:
        """Return how many calls are under way."""
        return self._active

    @property
    def waiting(self) -> int:
        """Return how many calls wait."""
        return len(self._waiting)

    @contextmanager
    def place(self, deadline: Deadline) -> Iterator[None]:
        """Hold a place for one call.

        Raises:
            Busy: too many wait already.
            TimedOut: no place became free in time.
        """
        self._enter(deadline)
        try:
            yield
        finally:
            with self._changed:
                self._active -= 1
                self._changed.notify_all()

    def _enter(self, deadline: Deadline) -> None:
        ticket = object()
        with self._changed:
            if self._active < self._max_calls and not self._waiting:
                self._active += 1
                return
            if len(self._waiting) >= self._max_waiting:
                raise Busy(f"{self._active} calls under way and {len(self._waiting)} wait already")
            self._waiting.append(ticket)
            try:
                if not self._changed.wait_for(lambda: self._is_turn(ticket), deadline.left_s):
                    raise TimedOut(f"no place within {deadline.given_s:g} s")
                self._active += 1
            finally:
                self._waiting.remove(ticket)
                self._changed.notify_all()

    def _is_turn(self, ticket: object) -> bool:
        return self._active < self._max_calls and self._waiting[0] is ticket


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


class BreakerState(StrEnum):
    """Say whether requests pass."""

    CLOSED = "closed"
    OPEN = "open"
    HALF_OPEN = "half_open"


class CircuitBreaker:
    """Open after failures in a row; after a time admit one request, which decides."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Backoff:
    """Wait anything from nothing to a bound that doubles: full jitter keeps robots apart.

    `draw` gives numbers from 0 to 1.
    """

    first_s: float
    longest_s: float
    draw: Callable[[], float]

    def wait_s(self, failures: int, error: ModelServerError) -> float:
        """Return the wait after the n-th failure; never less than the server asks for."""
        bound_s = min(self.longest_s, self.first_s * 2.0 ** (failures - 1))
        asked_s = error.wait_s if isinstance(error, ServerFailed) else None
        return max(self.draw() * bound_s, asked_s or 0.0)


def may_pass(error: ModelServerError) -> bool:
    """Return whether the same request may succeed a little later, and was not carried out."""
    if isinstance(error, ServerUnreachable):
        return not error.was_sent
    return isinstance(error, ServerFailed)
