"""Count what calls to a server cost and how they ended."""

import threading
from collections import Counter, deque
from statistics import quantiles
from typing import Any, Final

from vla_deploy.model_servers.chat import Completion

_KEPT: Final = 256


class CallMetrics:
    """Hold counts of one server since it was opened, and the times of its latest answers."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._calls = 0
        self._answers = 0
        self._retries = 0
        self._tokens_in = 0
        self._tokens_out = 0
        self._failures: Counter[str] = Counter()
        self._latencies_s: deque[float] = deque(maxlen=_KEPT)

    def answered(self, completion: Completion, latency_s: float) -> None:
        """Count an answer."""
        with self._lock:
            self._calls += 1
            self._answers += 1
            self._tokens_in += completion.tokens_in or 0
            self._tokens_out += completion.tokens_out or 0
            self._latencies_s.append(latency_s)

    def failed(self, error: Exception) -> None:
        """Count a call that gave no answer, by its kind of error."""
        with self._lock:
            self._calls += 1
            self._failures[type(error).__name__] += 1

    def retried(self) -> None:
        """Count a request that is sent again."""
        with self._lock:
            self._retries += 1

    def document(self) -> dict[str, Any]:
        """Return the counts as JSON takes them; times are null before the first answer."""
        with self._lock:
            times_s = sorted(self._latencies_s)
            return {
                "calls": self._calls,
                "answers": self._answers,
                "failures": dict(self._failures),
                "retries": self._retries,
                "tokens_in": self._tokens_in,
                "tokens_out": self._tokens_out,
                "latency_p50_s": percentile_s(times_s, 50),
                "latency_p95_s": percentile_s(times_s, 95),
                "latency_max_s": round(times_s[-1], 4) if times_s else None,
            }


def percentile_s(sorted_s: list[float], percent: int) -> float | None:
    """Return a percentile of sorted times, None where there are none."""
    if len(sorted_s) < 2:
        return round(sorted_s[0], 4) if sorted_s else None
    return round(quantiles(sorted_s, n=100, method="inclusive")[percent - 1], 4)
