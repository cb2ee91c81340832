"""Let only so many calls through at a time, and only so many wait, first come first served."""

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from vla_deploy.model_servers.errors import Busy, TimedOut
from vla_deploy.runtime.deadline import Deadline


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
