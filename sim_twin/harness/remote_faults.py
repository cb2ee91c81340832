"""Inject faults into the twin of a run in other processes, with the injector's own words."""

from pathlib import Path
from typing import Any

from vla_deploy.cli.twin import ask_twin


class RemoteFault:
    """Follow one fault of another process' twin."""

    def __init__(self, run_dir: Path, number: int) -> None:
        self.number = number
        self._run_dir = run_dir

    @property
    def is_on(self) -> bool:
        """Return whether the fault is in force now."""
        pending = ask_twin(self._run_dir, "fault_list")["pending"]
        return any(row["id"] == self.number and row["on"] for row in pending)

    def clear(self) -> None:
        """End the fault for good."""
        ask_twin(self._run_dir, "fault_clear", id=self.number)


class RemoteFaults:
    """Be to a run what `FaultInjector` is to a twin in one's own process."""

    def __init__(self, run_dir: Path) -> None:
        self._run_dir = run_dir

    def inject(
        self, component: str, instance: str | int | None, fault: str, **details: Any
    ) -> RemoteFault:
        """Add a fault; see `FaultInjector.inject`.

        Raises:
            UsageError: the twin refuses, or there is none.
        """
        words = {"component": component, "instance": instance, "fault": fault}
        answer = ask_twin(self._run_dir, "fault_inject", **details, **words)
        return RemoteFault(self._run_dir, answer["injected"]["id"])

    def clear_all(self) -> None:
        """End every fault."""
        ask_twin(self._run_dir, "fault_clear", id=None)
