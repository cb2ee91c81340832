"""Count what came of commands, and how each rung of the ladder has been doing."""

from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from vla_deploy.model_servers.metrics import percentile_s
from vla_deploy.planning.interfaces import Attempt

_KEPT: Final = 256


@dataclass(slots=True)
class _Rung:
    """Hold how often a rung ended how, and how long it took of late."""

    outcomes: Counter[str] = field(default_factory=Counter)
    took_s: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def document(self) -> dict[str, Any]:
        times_s = sorted(self.took_s)
        return {
            **self.outcomes,
            "p50_s": percentile_s(times_s, 50),
            "p95_s": percentile_s(times_s, 95),
        }


@dataclass(slots=True)
class Accounts:
    """Hold counts since the planner was started; `failed` are faults of the planner itself."""

    heard: int = 0
    planned: int = 0
    refused: int = 0
    asked: int = 0
    failed: int = 0
    _rungs: dict[str, _Rung] = field(default_factory=dict)

    def note(self, attempts: Iterable[Attempt]) -> None:
        """Count what the rungs did for one command."""
        for one in attempts:
            rung = self._rungs.setdefault(one.rung, _Rung())
            rung.outcomes[one.outcome.value] += 1
            rung.took_s.append(one.took_s)

    def document(self) -> dict[str, Any]:
        """Return the counts as JSON takes them."""
        counts = {
            "heard": self.heard,
            "planned": self.planned,
            "refused": self.refused,
            "asked": self.asked,
            "failed": self.failed,
        }
        return {**counts, "by_rung": {name: one.document() for name, one in self._rungs.items()}}
