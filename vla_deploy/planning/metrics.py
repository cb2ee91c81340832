"""Count what came of commands, and how each back end has been doing."""

from collections import Counter, defaultdict, deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from vla_deploy.model_servers.metrics import percentile_s
from vla_deploy.planning.interfaces import Attempt

_KEPT: Final = 256


@dataclass(slots=True)
class BackEndMetrics:
    """Hold how often a back end ended how, and how long it took of late."""

    outcomes: Counter[str] = field(default_factory=Counter)
    took_s: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def document(self) -> dict[str, Any]:
        """Return the counts and times as JSON takes them."""
        times_s = sorted(self.took_s)
        times = {f"p{percent}_s": percentile_s(times_s, percent) for percent in (50, 95)}
        return {**self.outcomes, **times}


@dataclass(slots=True)
class PlannerMetrics:
    """Hold counts since the planner was started; `failed` are faults of the planner itself."""

    heard: int = 0
    planned: int = 0
    refused: int = 0
    asked: int = 0
    failed: int = 0
    _back_ends: defaultdict[str, BackEndMetrics] = field(
        default_factory=lambda: defaultdict(BackEndMetrics)
    )

    def note(self, attempts: Iterable[Attempt]) -> None:
        """Count what the back ends did for one command."""
        for one in attempts:
            metrics = self._back_ends[one.back_end]
            metrics.outcomes[one.outcome.value] += 1
            metrics.took_s.append(one.took_s)

    def document(self) -> dict[str, Any]:
        """Return the counts as JSON takes them."""
        counts = ("heard", "planned", "refused", "asked", "failed")
        by_rung = {name: one.document() for name, one in self._back_ends.items()}
        return {**{name: getattr(self, name) for name in counts}, "by_rung": by_rung}
