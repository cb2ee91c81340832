"""Start, watch and end the children that the decisions of `lifecycle` speak of."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from vla_deploy.supervisor.lifecycle import Act, Action, Seen
from vla_deploy.supervisor.options import RunOptions
from vla_deploy.supervisor.orphans import RUN_ID_VARIABLE
from vla_deploy.supervisor.process import ChildProcess, last_lines
from vla_deploy.supervisor.readiness import Readiness
from vla_deploy.supervisor.table import ProcessSpec


class Crew:
    """Hold the running children of one run."""

    def __init__(
        self,
        table: Sequence[ProcessSpec],
        options: RunOptions,
        run_dir: Path,
        readiness: Mapping[str, Readiness],
    ) -> None:
        self._specs = {spec.name: spec for spec in table}
        self._options = options
        self._run_dir = run_dir
        self._readiness = readiness
        self._children: dict[str, ChildProcess] = {}
        self._environment = {**os.environ, RUN_ID_VARIABLE: run_dir.name}
        self._do: Mapping[Act, Callable[[str], None]] = {
            Act.SPAWN: self._spawn,
            Act.TERMINATE: lambda name: self._children[name].terminate(),
            Act.KILL: lambda name: self._children[name].kill(),
        }

    def observe(self) -> dict[str, Seen]:
        """Report every child that was ever started."""
        return {name: self._see(name, child) for name, child in self._children.items()}

    def perform(self, actions: Sequence[Action]) -> None:
        """Do what was decided, in order."""
        for act, name in actions:
            self._do[act](name)

    def pids(self) -> dict[str, int]:
        """Return the pid of each child that runs."""
        return {
            name: child.pid for name, child in self._children.items() if child.exit_code() is None
        }

    def is_fresh(self, name: str) -> bool:
        """Tell whether the running child's topic is young."""
        return self._readiness[name].is_fresh(self._children[name].pid)

    def last_words(self, name: str, count: int) -> list[str]:
        """Return the end of the child's log."""
        return last_lines(self._log_path(name), count)

    def kill_all(self) -> None:
        """End every child at once; only for when an orderly stop has failed."""
        for child in self._children.values():
            child.kill()

    def _see(self, name: str, child: ChildProcess) -> Seen:
        exit_code = child.exit_code()
        if exit_code is not None:
            return Seen(exit_code=exit_code)
        judge = self._readiness[name]
        return Seen(ready=judge.is_ready(child.pid), silent=judge.is_silent(child.pid))

    def _spawn(self, name: str) -> None:
        self._readiness[name].forget()
        spec = self._specs[name]
        command = spec.command + (spec.twin_command if self._options.twin else ())
        command += spec.viewer_command if self._options.viewer else ()
        command += spec.paced_command if self._options.paced else ()
        self._children[name] = ChildProcess(
            self._options.fill(command, self._run_dir), self._environment, self._log_path(name)
        )

    def _log_path(self, name: str) -> Path:
        return self._run_dir / "logs" / f"{name}.log"
