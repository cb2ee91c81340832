"""Judge measurements against their limits, with hysteresis; a missing number decides nothing."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum

from drivers.clock import NS_PER_S
from platforms import LadderTiming, ProcessBudget, TotalBudget

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
        """Return whether a value is so far from the limit that the excess has ended."""
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurement:
    """Hold one number, or None and why; `ended` means that the process does not run."""

    value: float | None
    reason: str = ""
    ended: bool = False


class BudgetStanding(Enum):
    """Name where a line stands."""

    OK = "ok"
    RISING = "rising"
    OVER = "over"
    FALLING = "falling"
    MISSING = "missing"


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetFinding:
    """Report one line: what was measured, how it stands, and since when.

    `over` is the answer with hysteresis. `beyond_since_ns` and `relieved_since_ns` say since when
    every value was beyond the limit, or well within it; both are None in between.
    """

    line: Line
    over: bool = False
    standing: BudgetStanding = BudgetStanding.OK
    measured: float | None = None
    reason: str = ""
    since_ns: int = 0
    beyond_since_ns: int | None = None
    relieved_since_ns: int | None = None

    def __str__(self) -> str:
        whose = f"{self.line.process}: " if self.line.process else ""
        than = "below" if self.line.at_least else "above"
        got = "unknown" if self.measured is None else f"{self.measured:.4g}"
        return f"{whose}{self.line.metric} {got} {than} its budget of {self.line.limit:g}"


Findings = Mapping[tuple[str, str], BudgetFinding]


def judge(
    lines: Iterable[Line],
    before: Findings,
    measured: Mapping[tuple[str, str], Measurement],
    timing: LadderTiming,
    now_ns: int,
) -> dict[tuple[str, str], BudgetFinding]:
    """Return the finding of every line.

    A line is over once every value has been beyond its limit for the rise time, and no longer once
    every value has been below the release ratio for the fall time.
    """
    return {
        line.key: _judge_one(
            _as_before(line, before.get(line.key), now_ns),
            measured.get(line.key, Measurement(value=None, reason="nobody measures it")),
            timing,
            now_ns,
        )
        for line in lines
    }


def _as_before(line: Line, before: BudgetFinding | None, now_ns: int) -> BudgetFinding:
    """Return the last finding of the line, a fresh one for a changed limit."""
    if before is None or before.line != line:
        return BudgetFinding(line=line, since_ns=now_ns)
    return before


def _judge_one(
    before: BudgetFinding, measurement: Measurement, timing: LadderTiming, now_ns: int
) -> BudgetFinding:
    value = measurement.value
    if value is None and not measurement.ended:
        return _with_standing(
            replace(before, beyond_since_ns=None, relieved_since_ns=None),
            BudgetStanding.MISSING,
            measurement,
            now_ns,
        )
    beyond = value is not None and before.line.is_beyond(value)
    relieved = value is None or before.line.is_relieved(value, timing.release_ratio)
    timed = replace(
        before,
        beyond_since_ns=_since(before.beyond_since_ns, beyond, now_ns),
        relieved_since_ns=_since(before.relieved_since_ns, relieved, now_ns),
    )
    over = _is_over(timed, timing, now_ns)
    return _with_standing(replace(timed, over=over), _standing(timed, over), measurement, now_ns)


def _since(since_ns: int | None, holds: bool, now_ns: int) -> int | None:
    if not holds:
        return None
    return now_ns if since_ns is None else since_ns


def lasts(since_ns: int | None, duration_s: float, now_ns: int) -> bool:
    """Return whether something has held for a while without a break."""
    return since_ns is not None and now_ns - since_ns >= round(duration_s * NS_PER_S)


def _is_over(timed: BudgetFinding, timing: LadderTiming, now_ns: int) -> bool:
    if timed.over:
        return not lasts(timed.relieved_since_ns, timing.fall_s, now_ns)
    return lasts(timed.beyond_since_ns, timing.rise_s, now_ns)


def _standing(timed: BudgetFinding, over: bool) -> BudgetStanding:
    if over:
        return (
            BudgetStanding.FALLING if timed.relieved_since_ns is not None else BudgetStanding.OVER
        )
    return BudgetStanding.RISING if timed.beyond_since_ns is not None else BudgetStanding.OK


def _with_standing(
    finding: BudgetFinding, standing: BudgetStanding, got: Measurement, now_ns: int
) -> BudgetFinding:
    since_ns = finding.since_ns if standing is finding.standing else now_ns
    return replace(
        finding, standing=standing, measured=got.value, reason=got.reason, since_ns=since_ns
    )
