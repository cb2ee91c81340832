"""Bring reality in line with the process table until someone asks to stop."""

import logging
import signal
from collections.abc import Callable, Mapping
from pathlib import Path

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import load_profile
from vla_deploy.exit_codes import EXIT_CONFIGURATION
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.crew import Crew
from vla_deploy.supervisor.errors import StartFailed, SupervisorError
from vla_deploy.supervisor.lifecycle import Record, State, reconcile
from vla_deploy.supervisor.options import RunOptions
from vla_deploy.supervisor.readiness import readiness_of
from vla_deploy.supervisor.report import Report
from vla_deploy.supervisor.runtime import Runtime, default_base
from vla_deploy.supervisor.table import TABLE, ProcessSpec

_PERIOD_NS = NS_PER_S // 20
_REPORT_NS = NS_PER_S // 2
_LAST_WORDS = 12
_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_TROUBLE = frozenset({State.BACKOFF, State.GIVEN_UP})
_log = logging.getLogger(__name__)


class Supervisor:
    """Start, watch, restart and stop the processes of one run.

    Use it as a context manager: leaving it stops everything in order. All calls belong to the main
    thread, because the kernel ends the children when the thread that started them ends.
    """

    def __init__(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...] = TABLE,
        clock: Clock | None = None,
    ) -> None:
        self.stop_requested = False
        self._options = options
        self._table = tuple(spec for spec in table if options.twin or not spec.needs_twin)
        self._clock: Clock = clock or MonotonicClock()
        self._records = {spec.name: Record() for spec in self._table}
        self._report_due_ns = 0
        self._run: _Run | None = None

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def run_dir(self) -> Path:
        """Return the directory of the run.

        Raises:
            SupervisorError: the run is not started.
        """
        return self._started().runtime.run_dir

    @property
    def space(self) -> SharedSpace:
        """Return the run's shared memory.

        Raises:
            SupervisorError: the run is not started.
        """
        return self._started().space

    def start(self) -> None:
        """Start every process in order and return when all are ready, or a stop is requested.

        Raises:
            AlreadyRunning: another supervisor holds the runtime directory.
            RuntimeUnavailable: the runtime directory cannot be used.
            ProfileError, RobotFileError: they have faults; nothing was started.
            StartFailed: a process was given up; everything is stopped again.
        """
        load_profile(self._options.profile)
        load_robot(self._options.robot)
        self._run = _Run(self._options, self._table, self._clock, self.request_stop)
        try:
            self._wait_until_ready()
        except BaseException:
            self.stop()
            raise
        if self._options.arm and not self.stop_requested:
            _arm(self._run.space)

    def step(self) -> None:
        """Look once, act once; whoever does not call `run_until_stopped` calls it every 50 ms."""
        self._step(stopping=False)

    def run_until_stopped(self) -> None:
        """Keep the processes running until SIGINT, SIGTERM, SIGHUP or `request_stop`."""
        while not self.stop_requested:
            self._pause()
            self.step()

    def request_stop(self) -> None:
        """Let `start` and `run_until_stopped` return soon."""
        self.stop_requested = True

    def stop(self) -> None:
        """Stop every process, the last started first, and remove the run; twice is allowed."""
        if self._run is None:
            return
        try:
            while any(record.state is not State.STOPPED for record in self._records.values()):
                self._step(stopping=True)
                self._pause()
        finally:
            self._run.close()
            self._run = None

    def _wait_until_ready(self) -> None:
        while not self.stop_requested:
            self.step()
            for name, record in self._records.items():
                if record.state is State.GIVEN_UP:
                    raise StartFailed(self._failure(name, record))
            if all(record.state is State.READY for record in self._records.values()):
                return
            self._pause()

    def _failure(self, name: str, record: Record) -> str:
        words = self._started().crew.last_words(name, _LAST_WORDS)
        if record.exit_code == EXIT_CONFIGURATION and words:
            return f"{name} did not start: {_without_sender(name, words[-1])}"
        return "\n".join([f"{name} did not start: {record.reason}", *words])

    def _step(self, *, stopping: bool) -> None:
        run, now_ns, before = self._started(), self._clock.now_ns(), self._records
        self._records, actions = reconcile(
            self._table, before, run.crew.observe(), stopping=stopping, now_ns=now_ns
        )
        run.crew.perform(actions)
        changed = _log_changes(before, self._records)
        if changed or now_ns >= self._report_due_ns:
            self._report_due_ns = now_ns + _REPORT_NS
            run.report.publish(self._records, run.crew)

    def _pause(self) -> None:
        self._clock.sleep_until(self._clock.now_ns() + _PERIOD_NS)

    def _started(self) -> "_Run":
        if self._run is None:
            raise SupervisorError("the run is not started: call start() first")
        return self._run


class _Run:
    """Hold everything that exists only between start and stop."""

    def __init__(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...],
        clock: Clock,
        on_stop_signal: Callable[[], None],
    ) -> None:
        self.runtime = Runtime(options.runtime_base or default_base())
        run_dir = self.runtime.run_dir
        try:
            self.space = SharedSpace(run_dir / "ipc", clock)
            self.crew = Crew(
                table, options, run_dir, readiness_of(table, run_dir, self.space, clock)
            )
            self.report = Report(self.runtime.run_id, options, self.space, clock)
        except BaseException:
            self.runtime.close()
            raise
        self._handlers = {
            number: signal.signal(number, lambda *_: on_stop_signal())
            for number in _STOP_SIGNALS
            if not _is_ignored_hangup(number)
        }

    def close(self) -> None:
        """End whoever is left, remove the run, give the signals back."""
        self.crew.kill_all()
        self.space.close()
        self.runtime.close()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)


def _is_ignored_hangup(number: int) -> bool:
    """Tell whether whoever started this wants it to outlive the terminal, as nohup does."""
    return number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN


def _without_sender(name: str, line: str) -> str:
    """Return a process' last line without the name and level in front of it."""
    return line.removeprefix(f"{name}: ").removeprefix("ERROR: ")


def _arm(space: SharedSpace) -> None:
    space.ring_writer("operator").publish(
        {"act": "arm", "source": "supervisor", "reason": "asked for by --arm"}
    )


def _log_changes(before: Mapping[str, Record], after: Mapping[str, Record]) -> bool:
    changed = [name for name, record in after.items() if record.state is not before[name].state]
    for name in changed:
        record = after[name]
        level = logging.WARNING if record.state in _TROUBLE else logging.INFO
        _log.log(
            level, "%s: %s%s", name, record.state.value, record.reason and f" ({record.reason})"
        )
    return bool(changed)
