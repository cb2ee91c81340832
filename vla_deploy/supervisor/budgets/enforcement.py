"""Enforce the budgets of processes as far as this machine really can, and say how."""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from platforms import ProcessBudget
from vla_deploy.supervisor.budgets.cgroup import CgroupRefused, CgroupTree, cpu_max, memory_bytes
from vla_deploy.supervisor.budgets.hold_back import CpuHold, HoldRefused, MemoryHold
from vla_deploy.supervisor.budgets.judge import BudgetFinding

# The ladder acts at the budget itself; the kernel stops a process that exceeds it further.
HIGH_RATIO: Final = 1.2
HARD_RATIO: Final = 1.5
CONTROL_WEIGHT: Final = "1000"
MOST_TASKS: Final = "512"
EXEMPT: Final[Mapping[str, str]] = {
    "supervisor": "it enforces the others' budgets",
    "control": "a control loop that is held back is late",
    "twin": "it stands for the hardware",
}
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Enforced:
    """Describe for one process how its memory and its CPU budget are enforced."""

    memory: str
    cpu: str


_IDLE: Final = "none, because it does not run"
_METRICS: Final = ("cpu_ratio", "memory_mb")
_WHEN_OVER: Final[Mapping[str, str]] = {
    "memory_mb": "rlimit once it is over",
    "cpu_ratio": "nice and affinity once it is over",
}


class Enforcer:
    """Put every process into its control group; without one, hold it back while it is over."""

    def __init__(self, cgroups: CgroupTree) -> None:
        self._cgroups = cgroups
        self._budgets: Mapping[str, ProcessBudget] = {}
        self._pids: dict[str, int] = {}
        self._rules: dict[tuple[str, str], str] = {}
        """How each metric of a process is enforced, in words."""
        self._refused: dict[tuple[str, str], str] = {}
        self._held: dict[tuple[str, str], CpuHold | MemoryHold] = {}

    @property
    def enforced(self) -> dict[str, Enforced]:
        """Return for every process that has a budget how it is enforced now."""
        return {
            name: Enforced(
                memory=self._rules.get(("memory_mb", name), _IDLE),
                cpu=self._rules.get(("cpu_ratio", name), _IDLE),
            )
            for name in self._budgets
        }

    def adopt(self, budgets: Mapping[str, ProcessBudget]) -> None:
        """Enforce these budgets from now on; processes held back by the former are released.

        It comes before the processes get the profile: what they then set themselves must stay.
        """
        for (_, name), held in self._held.items():
            try:
                held.release()
            except HoldRefused as error:
                _log.warning("budgets: %s stays held back: %s", name, error)
        self._held.clear()
        self._budgets = budgets
        self._pids.clear()

    def enforce(self, pids: Mapping[str, int], findings: Iterable[BudgetFinding]) -> None:
        """Take in new processes; hold back what is over its budget, release what no longer is."""
        for name in [name for name in self._pids if name not in pids]:
            self._forget(name)
        for name, pid in pids.items():
            if name in self._budgets and self._pids.get(name) != pid:
                self._admit(name, pid)
        over = {finding.line.key: finding for finding in findings if finding.over}
        for name in sorted(self._pids.keys() - EXEMPT.keys()):
            for metric in _METRICS:
                self._settle(metric, name, over.get((metric, name)))

    def close(self) -> None:
        """Remove the control groups."""
        self._cgroups.close()

    def _forget(self, name: str) -> None:
        self._pids.pop(name, None)
        for metric in _METRICS:
            self._rules.pop((metric, name), None)
            self._held.pop((metric, name), None)
            self._refused.pop((metric, name), None)

    def _admit(self, name: str, pid: int) -> None:
        self._forget(name)
        self._pids[name] = pid
        if name in EXEMPT:
            weight = {"cpu.weight": CONTROL_WEIGHT} if name == "control" else {}
            none = f"none, because {EXEMPT[name]}"
            self._rules["memory_mb", name] = none
            self._rules["cpu_ratio", name] = none + self._preferred(name, pid, weight)
            return
        budget = self._budgets[name]
        memory = {
            "memory.high": memory_bytes(HIGH_RATIO * budget.memory_mb),
            "memory.max": memory_bytes(HARD_RATIO * budget.memory_mb),
        }
        cpu = {"cpu.max": cpu_max(HARD_RATIO * budget.cpu_ratio)}
        self._group("memory_mb", name, pid, "memory", memory)
        self._group("cpu_ratio", name, pid, "cpu", cpu)
        refusal = self._limited(name, pid, "pids", {"pids.max": MOST_TASKS})
        if refusal:
            _log.debug("budgets: %s: its number of tasks is not bounded: %s", name, refusal)

    def _group(
        self, metric: str, name: str, pid: int, controller: str, limits: Mapping[str, str]
    ) -> None:
        """Set limits in the process' group; where that fails, note that it is to be held back."""
        if refusal := self._limited(name, pid, controller, limits):
            self._refused[metric, name] = refusal
            text = f"{_WHEN_OVER[metric]}, because {refusal}"
        else:
            text = "cgroup: " + ", ".join(f"{file} {value}" for file, value in limits.items())
        self._rules[metric, name] = text

    def _limited(self, name: str, pid: int, controller: str, limits: Mapping[str, str]) -> str:
        refusal = self._cgroups.refusals.get(controller, "")
        if refusal:
            return refusal
        try:
            for file, value in limits.items():
                self._cgroups.limit(name, file, value)
            self._cgroups.place(name, pid)
        except CgroupRefused as error:
            return str(error)
        return ""

    def _preferred(self, name: str, pid: int, weight: Mapping[str, str]) -> str:
        if not weight or self._limited(name, pid, "cpu", weight):
            return ""
        return f"; cgroup: cpu.weight {CONTROL_WEIGHT}"

    def _settle(self, metric: str, name: str, excess: BudgetFinding | None) -> None:
        """Hold a process back while it is over, where its group does not; release it after that.

        What is refused is tried again with the next measurement.
        """
        key = metric, name
        held = self._held.get(key)
        if key not in self._refused or (excess is None) == (held is None):
            return
        try:
            if excess is not None:
                self._held[key] = self._hold(excess)
            elif held is not None:
                held.release()
                del self._held[key]
        except HoldRefused as error:
            text = f"{'none' if held is None else held}, because {error}"
            if text != self._rules[key]:  # logged when it begins, not with each measurement
                _log.warning("budgets: %s: %s is enforced by %s", name, metric, text)
        else:
            text = f"{self._held.get(key, _WHEN_OVER[metric])}, because {self._refused[key]}"
        self._rules[key] = text

    def _hold(self, excess: BudgetFinding) -> CpuHold | MemoryHold:
        pid, limit = self._pids[excess.line.process], excess.line.limit
        if excess.line.metric == "cpu_ratio":
            return CpuHold.take(pid, limit)
        used_mb = excess.measured if excess.measured is not None else limit
        return MemoryHold.take(pid, HARD_RATIO * limit - used_mb)
