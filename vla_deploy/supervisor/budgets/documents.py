"""Compose the documents by which the budgets are shown and followed."""

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Final

from drivers.clock import NS_PER_S
from platforms import LadderAction, LadderStep
from platforms.probes import Reading
from vla_deploy.ipc.payloads.supervision import (
    BoardDocument,
    BudgetRow,
    EnforcementRow,
    LadderStepDocument,
    ResourceDirectives,
    StepChange,
    TakenStep,
)
from vla_deploy.supervisor.budgets.enforcement import Enforced
from vla_deploy.supervisor.budgets.judge import BudgetFinding
from vla_deploy.supervisor.budgets.ladder import LadderMove, Taken

_LONGEST_REASON: Final = 160
_MOST_READINGS: Final = 128
_OF_A_PROCESS: Final = "gpu_memory_used_bytes."


def directives(taken: Iterable[Taken]) -> ResourceDirectives:
    """Return the `resource_directives` document, which the processes follow.

    A process with several slow steps in force keeps the smallest of their ratios; each
    smaller_model step brings it one tier down.
    """
    steps = [one.step for one in taken]
    rates: dict[str, float] = {}
    for step in _of(steps, LadderAction.SLOW):
        rates[step.process] = min(step.ratio, rates.get(step.process, 1.0))
    tiers = Counter(step.process for step in _of(steps, LadderAction.SMALLER_MODEL))
    suspended = sorted({step.process for step in _of(steps, LadderAction.SUSPEND)})
    return {"rate_ratio": rates, "model_tier": dict(tiers), "suspended": suspended}


def _of(steps: Iterable[LadderStep], action: LadderAction) -> list[LadderStep]:
    return [step for step in steps if step.action is action]


def stop_reason(taken: Iterable[Taken]) -> str:
    """Return why the robot must not move, or ""."""
    stops = [one.why for one in taken if one.step.action is LadderAction.PROTECTIVE_STOP]
    return stops[0] if stops else ""


def rows(findings: Iterable[BudgetFinding], now_ns: int) -> list[BudgetRow]:
    """Return each line with what was measured and how it stands."""
    return [
        {
            "process": finding.line.process or None,
            "metric": finding.line.metric,
            "measured": None if finding.measured is None else round(finding.measured, 3),
            "limit": finding.line.limit,
            "at_least": finding.line.at_least,
            "state": finding.standing.value,
            "over": finding.over,
            "since_s": _age_s(finding.since_ns, now_ns),
            "reason": finding.reason[:_LONGEST_REASON],
        }
        for finding in findings
    ]


def ladder_rows(taken: Iterable[Taken], now_ns: int) -> list[TakenStep]:
    """Return the steps in force, in the order they were taken."""
    return [
        {**_step(one.step), "since_s": _age_s(one.since_ns, now_ns), "why": _short(one.why)}
        for one in taken
    ]


def history_rows(changes: Iterable[LadderMove], now_ns: int) -> list[StepChange]:
    """Return the latest changes, oldest first."""
    return [
        {
            **_step(one.step),
            "taken": one.taken,
            "ago_s": _age_s(one.at_ns, now_ns),
            "why": _short(one.why),
        }
        for one in changes
    ]


def board(readings: Iterable[Reading]) -> BoardDocument:
    """Return what the probes read, or why not, without the readings of single processes."""
    values: dict[str, float] = {}
    missing: dict[str, str] = {}
    for reading in islice(readings, _MOST_READINGS):
        if reading.value is None:
            missing[reading.name] = _short(reading.reason)
        elif not reading.name.startswith(_OF_A_PROCESS):
            values[reading.name] = float(f"{reading.value:.9g}")
    return {"readings": values, "missing": missing}


def enforcement_rows(enforced: Mapping[str, Enforced]) -> list[EnforcementRow]:
    """Return for each process which limit is enforced how."""
    return [
        {"process": process, "memory": one.memory, "cpu": one.cpu}
        for process, one in enforced.items()
    ]


def _step(step: LadderStep) -> LadderStepDocument:
    return {"action": step.action.value, "process": step.process or None, "ratio": step.ratio}


def _age_s(since_ns: int, now_ns: int) -> float:
    return round((now_ns - since_ns) / NS_PER_S, 1)


def _short(text: str) -> str:
    return text[:_LONGEST_REASON]
