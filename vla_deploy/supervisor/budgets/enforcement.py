"""Enforce the budgets of processes as far as this machine really can, and say how."""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from platforms import ProcessBudget
from vla_deploy.supervisor.budgets.cgroup import CgroupRefused, CgroupTree, cpu_max, memory_bytes
from vla_deploy.supervisor.budgets.hold_back import CpuHold, HoldRefused, MemoryHold
from vla_deploy.supervisor.budgets.judge import BudgetFinding

# The ladder acts at the budget itself; the kernel stops whoever runs past it all the same.
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
    """Say in words for one process how its memory and its CPU budget are enforced."""

    memory: str
    cpu: str


IDLE: Final = Enforced(memory="none, because it does not run", cpu="none, because it does not run")


class Enforcer:
    """Put every process into its control group; without one, hold back who is over its budget."""

    def __init__(self, cgroups: CgroupTree) -> None:
        self._cgroups = cgroups
        self._budgets: Mapping[str, ProcessBudget] = {}
        self._pids: dict[str, int] = {}
        self._rules: dict[str, Enforced] = {}
        self._refused: dict[tuple[str, str], str] = {}
        self._held: dict[tuple[str, str], CpuHold | MemoryHold] = {}

    @property
    def enforced(self) -> dict[str, Enforced]:
        """Return for every process that has a budget how it is enforced now."""
        return {name: self._rules.get(name, IDLE) for name in self._budgets}

    def adopt(self, budgets: Mapping[str, ProcessBudget]) -> None:
        """Enforce these budgets from now on; who is held back by the ones before is released.

        Before the processes hear of the profile: what they then set for themselves shall stay.
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
        """Take in new processes, hold back who is over, release who no longer is."""
        for name in [name for name in self._pids if name not in pids]:
            self._forget(name)
        for name, pid in pids.items():
            if name in self._budgets and self._pids.get(name) != pid:
                self._welcome(name, pid)
        over = {finding.line.key: finding for finding in findings if finding.over}
        for name in sorted(self._pids.keys() - EXEMPT.keys()):
            for metric in ("cpu_ratio", "memory_mb"):
                self._settle(metric, name, over.get((metric, name)))

    def close(self) -> None:
        """Give back what was made."""
        self._cgroups.close()

    def _forget(self, name: str) -> None:
        self._pids.pop(name, None)
        self._rules.pop(name, None)
        for metric in ("cpu_ratio", "memory_mb"):
            self._held.pop((metric, name), None)
            self._refused.pop((metric, name), None)

    def _welcome(self, name: str, pid: int) -> None:
        self._forget(name)
        self._pids[name] = pid
        if name in EXEMPT:
            weight = {"cpu.weight": CONTROL_WEIGHT} if name == "control" else {}
            self._rules[name] = Enforced(
                memory=f"none, because {EXEMPT[name]}",
                cpu=f"none, because {EXEMPT[name]}" + self._preferred(name, pid, weight),
            )
            return
        budget = self._budgets[name]
        memory = {
            "memory.high": memory_bytes(HIGH_RATIO * budget.memory_mb),
            "memory.max": memory_bytes(HARD_RATIO * budget.memory_mb),
        }
        cpu = {"cpu.max": cpu_max(HARD_RATIO * budget.cpu_ratio)}
        self._rules[name] = Enforced(
            memory=self._grouped("memory_mb", name, pid, "memory", memory),
            cpu=self._grouped("cpu_ratio", name, pid, "cpu", cpu),
        )
        self._bound_tasks(name, pid)

    def _grouped(
        self, metric: str, name: str, pid: int, controller: str, limits: Mapping[str, str]
    ) -> str:
        """Set limits in the process' group; where that fails, note that it is to be held back."""
        refusal = self._limited(name, pid, controller, limits)
        if not refusal:
            return "cgroup: " + ", ".join(f"{file} {value}" for file, value in limits.items())
        self._refused[metric, name] = refusal
        return f"{_WHEN_OVER[metric]}, because {refusal}"

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

    def _bound_tasks(self, name: str, pid: int) -> None:
        refusal = self._limited(name, pid, "pids", {"pids.max": MOST_TASKS})
        if refusal:
            _log.debug("budgets: %s: its number of tasks is not bounded: %s", name, refusal)

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
            self._warn(metric, name, f"{'none' if held is None else held}, because {error}")
            return
        self._say(metric, name, self._described(key))

    def _hold(self, excess: BudgetFinding) -> CpuHold | MemoryHold:
        pid, limit = self._pids[excess.line.process], excess.line.limit
        if excess.line.metric == "cpu_ratio":
            return CpuHold.take(pid, limit)
        used_mb = excess.measured if excess.measured is not None else limit
        return MemoryHold.take(pid, HARD_RATIO * limit - used_mb)

    def _described(self, key: tuple[str, str]) -> str:
        held, refusal = self._held.get(key), self._refused[key]
        return f"{held}, because {refusal}" if held else f"{_WHEN_OVER[key[0]]}, because {refusal}"

    def _say(self, metric: str, name: str, text: str) -> None:
        rule = self._rules[name]
        memory = text if metric == "memory_mb" else rule.memory
        cpu = text if metric == "cpu_ratio" else rule.cpu
        self._rules[name] = Enforced(memory=memory, cpu=cpu)

    def _warn(self, metric: str, name: str, text: str) -> None:
        """Say what was refused, and log it when it begins, not with each measurement."""
        rule = self._rules[name]
        self._say(metric, name, text)
        if self._rules[name] != rule:
            _log.warning("budgets: %s: %s is enforced by %s", name, metric, text)


_WHEN_OVER: Final[Mapping[str, str]] = {
    "memory_mb": "rlimit once it is over",
    "cpu_ratio": "nice and affinity once it is over",
}
