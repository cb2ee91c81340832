"""Turn a profile's budgets into lines: what is measured, for whom, and where its limit lies."""

from collections.abc import Mapping
from dataclasses import dataclass

from platforms import ProcessBudget, TotalBudget

TOTAL = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """Declare one limit; `process` is empty for the whole robot, `at_least` marks a lower limit."""

    metric: str
    limit: float
    process: str = TOTAL
    at_least: bool = False

    @property
    def key(self) -> tuple[str, str]:
        """Return what the line is looked up by."""
        return self.metric, self.process

    def is_beyond(self, value: float) -> bool:
        """Return whether a value breaks the limit."""
        return value < self.limit if self.at_least else value > self.limit

    def is_relieved(self, value: float, release_ratio: float) -> bool:
        """Return whether a value keeps so far from the limit that the excess is over."""
        if self.at_least:
            return value >= self.limit / release_ratio
        return value <= self.limit * release_ratio


def lines_of(budgets: Mapping[str, ProcessBudget], total: TotalBudget) -> tuple[Line, ...]:
    """Return every line that a profile declares, those of processes first."""
    own = [
        Line(metric=metric, limit=getattr(budget, metric), process=process)
        for process, budget in budgets.items()
        for metric in ("memory_mb", "cpu_ratio")
    ]
    whole = [
        Line(metric=metric, limit=limit, at_least=metric == "disk_free_mb")
        for metric in _TOTAL_METRICS
        if (limit := getattr(total, metric)) is not None
    ]
    return (*own, *whole)


_TOTAL_METRICS = (
    "memory_mb",
    "cpu_ratio",
    "gpu_memory_mb",
    "power_w",
    "temperature_c",
    "disk_free_mb",
)
