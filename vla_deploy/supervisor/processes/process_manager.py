"""Start, watch and end the child processes as `lifecycle` decides."""

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock
from platforms import Profile
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots.ros_settings import RosSettings
from vla_deploy.runtime.logs import LOGS_DIR, RUN_ID_VARIABLE, journal_stream
from vla_deploy.runtime.twin_members import MEMBERSHIPS
from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.lifecycle import Action, ProcessAct, ProcessSeen
from vla_deploy.supervisor.processes.liveness import Liveness, Readiness, Vital
from vla_deploy.supervisor.processes.process import ChildProcess
from vla_deploy.supervisor.processes.ros_environment import launch_environment
from vla_deploy.supervisor.runs.log_files import OUTPUT_SUFFIX
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import PROCESS_VARIABLE, end_leftovers
from vla_deploy.supervisor.systemd import hide_from_children
from vla_deploy.supervisor.table import ProcessSpec

_THREAD_VARIABLES: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_STDERR = 2
_MOST_OUTPUT_BYTES = 4_000_000


class ProcessManager:
    """Hold the running children of one run."""

    def __init__(
        self,
        table: Sequence[ProcessSpec],
        options: RunOptions,
        run_dir: Path,
        space: SharedSpace,
        clock: Clock,
        profile: Callable[[], Profile],
        ros: RosSettings,
    ) -> None:
        self.started: dict[str, tuple[int, int]] = {}
        """The pid of each child that was started last, and when; none where that was refused."""
        self.profile = options.profile
        """The name of the profile that a child is started with."""
        self.started_under: dict[str, str] = {}
        """The profile that each child was started with."""
        self._specs = {spec.name: spec for spec in table}
        self._options = options
        self._run_dir = run_dir
        self._readiness = {row.name: Readiness(row, run_dir, space, clock) for row in table}
        self._liveness = {row.name: Liveness(row, space, clock, profile) for row in table}
        self._clock = clock
        self._profile_in_force = profile
        self._ros = ros
        self._children: dict[str, ChildProcess] = {}
        self._ready: set[str] = set()
        self._unswept: set[str] = set()
        self._refused: dict[str, str] = {}
        self._environment = {
            **os.environ,
            RUN_ID_VARIABLE: run_dir.name,
            "PYTHONFAULTHANDLER": "1",  # a process that hangs is aborted, and writes its traceback
        }
        hide_from_children(self._environment)
        if not journal_stream(os.environ, _STDERR):
            self._environment.pop("JOURNAL_STREAM", None)
        self._do: Mapping[ProcessAct, Callable[[str], None]] = {
            ProcessAct.SPAWN: self._spawn,
            ProcessAct.TERMINATE: lambda name: self._signal(name, ChildProcess.terminate),
            ProcessAct.ABORT: lambda name: self._signal(name, ChildProcess.abort),
            ProcessAct.KILL: lambda name: self._signal(name, ChildProcess.kill),
        }

    def observe(self) -> dict[str, ProcessSeen]:
        """Report every child that was ever started, or could not be."""
        seen = {name: self._see(name, child) for name, child in self._children.items()}
        return seen | {name: ProcessSeen(refused=why) for name, why in self._refused.items()}

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
        """Return whether the running child's topic is young."""
        return self._readiness[name].is_fresh(self._children[name].pid)

    def examine(self, rate_ratios: Mapping[str, float]) -> dict[str, tuple[Vital, ...]]:
        """Return the vital signs of each child that is ready; call it at a steady pace."""
        return {
            name: self._liveness[name].examine(pid, rate_ratios.get(name, 1.0))
            for name, pid in self.pids().items()
            if name in self._ready
        }

    def forgive_silence(self) -> None:
        """Count silence from now on, as after a time in which it was not measured."""
        for name in self._ready:
            self._liveness[name].begin()

    def bound_output(self) -> None:
        """Empty what a child has written past its log when that has grown large."""
        for name in self._children:
            _bound(self._output_path(name))

    def kill_all(self) -> None:
        """Kill every child, and what any of them has started."""
        for child in self._children.values():
            child.kill()
        end_leftovers(self._run_dir.name)

    def _see(self, name: str, child: ChildProcess) -> ProcessSeen:
        exit_code = child.exit_code()
        if exit_code is not None:
            self._sweep_after(name)
            return ProcessSeen(exit_code=exit_code)
        ready = self._readiness[name].is_ready(child.pid)
        if ready and name not in self._ready:
            self._ready.add(name)
            self._liveness[name].begin()
        silence = self._liveness[name].silence(child.pid) if name in self._ready else ""
        return ProcessSeen(ready=ready, silence=silence)

    def _sweep_after(self, name: str) -> None:
        """End, once, what an ended child has left outside its process group."""
        if name in self._unswept:
            self._unswept.remove(name)
            self._ready.discard(name)
            end_leftovers(self._run_dir.name, name)

    def _signal(self, name: str, send: Callable[[ChildProcess], None]) -> None:
        """Signal a child, unless the computer could not start it."""
        if name in self._children:
            send(self._children[name])

    def _spawn(self, name: str) -> None:
        """Start a child; where the computer cannot, note why."""
        self._refused.pop(name, None)
        try:
            child = self._new_child(name)
        except (OSError, RosNotFound) as error:
            self._refused[name] = str(error)
            self._children.pop(name, None)
            self.started.pop(name, None)
            return
        self._children[name] = child
        self._unswept.add(name)
        self.started_under[name] = self.profile
        self.started[name] = (child.pid, self._clock.now_ns())
        membership = MEMBERSHIPS.get(name)
        if membership is not None and isinstance(self._clock, TwinClock):
            loading_ns = round(membership.loading_s * NS_PER_S)
            self._clock.expect(child.pid, membership.role, loading_ns)

    def _new_child(self, name: str) -> ChildProcess:
        self._readiness[name].forget()
        spec = self._specs[name]
        command = spec.command + (spec.devices_command if self._options.takes_devices else ())
        command += spec.viewer_command if self._options.viewer else ()
        command += spec.paced_command if self._options.paced else ()
        python, variables = self._interpreter(spec)
        settings = self._profile_in_force().processes.get(name)
        threads = dict.fromkeys(_THREAD_VARIABLES, str(settings.threads)) if settings else {}
        return ChildProcess(
            replace(self._options, profile=self.profile).fill(command, self._run_dir),
            {
                **self._environment,
                **threads,
                **variables,
                **self._options.variables.get(name, {}),
                PROCESS_VARIABLE: name,
            },
            self._output_path(name),
            settings.nice if settings else 0,
            python,
        )

    def _interpreter(self, spec: ProcessSpec) -> tuple[str, Mapping[str, str]]:
        if not spec.in_ros_environment:
            return sys.executable, {}
        python, variables = launch_environment(self._ros, self._run_dir)
        return str(python), variables

    def _output_path(self, name: str) -> Path:
        return self._run_dir / LOGS_DIR / f"{name}{OUTPUT_SUFFIX}"


def _bound(path: Path) -> None:
    try:
        if path.stat().st_size > _MOST_OUTPUT_BYTES:
            os.truncate(path, 0)
    except FileNotFoundError:
        return  # removed from outside: without a name it cannot be shortened
