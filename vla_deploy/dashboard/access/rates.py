"""Limit the rate of requests, and slow down password guesses."""

import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock

MOST_KEYS: Final = 4096
"""More addresses at once are an attack: the least recently seen one is forgotten."""


class TokenBuckets:
    """Admit `burst` requests at once, and `rate_hz` in the long run, for each key."""

    def __init__(self, rate_hz: float, burst: int, clock: Clock) -> None:
        self._rate_hz = rate_hz
        self._burst = burst
        self._clock = clock
        self._lock = threading.Lock()
        self._by_key: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def take(self, key: str) -> float:
        """Take one token; return 0, or the seconds until there is one."""
        with self._lock:
            now_ns = self._clock.now_ns()
            left, seen_ns = self._by_key.pop(key, (float(self._burst), now_ns))
            left = min(self._burst, left + self._rate_hz * (now_ns - seen_ns) / NS_PER_S)
            wait_s = 0.0 if left >= 1.0 else (1.0 - left) / self._rate_hz
            self._by_key[key] = (left - 1.0 if wait_s == 0.0 else left, now_ns)
            _bound(self._by_key)
            return wait_s


@dataclass(frozen=True, slots=True, kw_only=True)
class BackOffRule:
    """Allow `free` failures, then wait `first_s`, doubled by each further one up to `longest_s`.

    Failures are forgotten `forget_s` after the last.
    """

    free: int = 5
    first_s: float = 1.0
    longest_s: float = 300.0
    forget_s: float = 3600.0


class BackOff:
    """Make each key wait longer with every failure.

    An attempt counts as a failure from its start on, so that parallel ones gain nothing.
    """

    def __init__(self, rule: BackOffRule, clock: Clock) -> None:
        self._rule = rule
        self._clock = clock
        self._lock = threading.Lock()
        self._by_key: OrderedDict[str, tuple[int, int]] = OrderedDict()

    def wait_s(self, key: str) -> float:
        """Return how long a key has to wait, 0 when it may try now."""
        with self._lock:
            failures, last_ns = self._by_key.get(key, (0, 0))
            passed_s = (self._clock.now_ns() - last_ns) / NS_PER_S
            if failures < self._rule.free or passed_s > self._rule.forget_s:
                return 0.0
            doubled_s = self._rule.first_s * 2.0 ** min(failures - self._rule.free, 30)
            return max(0.0, min(self._rule.longest_s, doubled_s) - passed_s)

    def begin(self, key: str) -> None:
        """Count an attempt as failed, until `succeeded` is called."""
        with self._lock:
            now_ns = self._clock.now_ns()
            failures, last_ns = self._by_key.pop(key, (0, now_ns))
            is_forgotten = (now_ns - last_ns) / NS_PER_S > self._rule.forget_s
            self._by_key[key] = (1 if is_forgotten else failures + 1, now_ns)
            _bound(self._by_key)

    def succeeded(self, key: str) -> None:
        """Forget the failures of a key."""
        with self._lock:
            self._by_key.pop(key, None)


def _bound(held: "OrderedDict[str, Any]") -> None:
    while len(held) > MOST_KEYS:
        held.popitem(last=False)
