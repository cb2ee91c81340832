"""Hold everything that exists only between the start and the stop of a run."""

import logging
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drivers.clock import Clock, MonotonicClock
from drivers.twin_clock import TwinClock, clock_of
from drivers.twin_page import PAGE_FILE, TIME_LINK, TimePage
from platforms import Profile
from platforms.power_switch import PowerSwitch
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots.ros_settings import RosSettings
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.journal import JOURNAL_SOCKET
from vla_deploy.runtime.logs import LOGS_DIR, LogOrigin, RunLog, journal_stream
from vla_deploy.runtime.twin_members import SUPERVISOR
from vla_deploy.supervisor.budgets import open_keeper
from vla_deploy.supervisor.directives import Directives
from vla_deploy.supervisor.health import Health
from vla_deploy.supervisor.notify import Notifier, NotifyTarget
from vla_deploy.supervisor.processes.crash_reports import CrashReports, crash_folder
from vla_deploy.supervisor.processes.liveness import liveness_of
from vla_deploy.supervisor.processes.process_manager import Crew
from vla_deploy.supervisor.processes.readiness import readiness_of
from vla_deploy.supervisor.profiles.power_at_start import set_at_start
from vla_deploy.supervisor.profiles.profile_choice import choice_of
from vla_deploy.supervisor.profiles.profile_switch import ProfileSwitch
from vla_deploy.supervisor.report import ProcessTableWriter
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import Runtime, default_base
from vla_deploy.supervisor.runs.serial_workers import SerialWorkers
from vla_deploy.supervisor.table import ProcessSpec

_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STDERR = 2
_log = logging.getLogger(__name__)


class Run:
    """Own the run's directory, its shared memory, its children and who reports on them."""

    def __init__(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...],
        clock: Clock | None,
        profile: Callable[[], Profile],
        notify: NotifyTarget,
        on_stop_signal: Callable[[], None],
        ros: RosSettings,
    ) -> None:
        self._handlers = _handle_stop_signals(on_stop_signal)
        try:
            self.runtime = Runtime(options.runtime_base or default_base())
        except BaseException:
            self._give_signals_back()
            raise
        try:
            self.clock = clock or _clock_of_run(options, self.runtime.run_dir)
            """The clock of the run, by which its processes live."""
            self._open(options, table, self.clock, profile, notify, ros)
        except BaseException:
            self.runtime.close()
            self._give_signals_back()
            raise

    def _open(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...],
        clock: Clock,
        profile: Callable[[], Profile],
        notify: NotifyTarget,
        ros: RosSettings,
    ) -> None:
        run_dir = self.runtime.run_dir
        self.space = SharedSpace(run_dir / "ipc", clock)
        self.crew = Crew(
            table,
            options,
            run_dir,
            readiness_of(table, run_dir, self.space, clock),
            liveness_of(table, self.space, clock, profile),
            clock,
            ros,
        )
        self.report = ProcessTableWriter(self.runtime.run_id, options, self.space, clock)
        self.budgets = open_keeper(
            profile,
            self.space,
            clock,
            state_dir=self.runtime.state_dir,
            probe_root=options.probe_root,
        )
        self.directives = Directives(self.space)
        power, executor = PowerSwitch(), low_priority_thread(clock)
        self.switch = ProfileSwitch(
            options.profile,
            profile(),
            self.space,
            clock,
            choice_of(options.runtime_base),
            power,
            executor,
            on_change=self.budgets.adopt,
            fault=options.profile_fault,
        )
        self.health = Health(self.space, clock, lambda: profile().control_rate_hz)
        # The kernel's workers and systemd go by the wall clock, whatever time the robot has.
        self.serial_workers = SerialWorkers(MonotonicClock())
        self.notifier = Notifier(notify, MonotonicClock())
        self.crashes = CrashReports(
            crash_folder(self.runtime.state_dir), run_dir, options, self.space, clock
        )
        origin = LogOrigin(process="supervisor", robot=options.robot, run_id=run_dir.name)
        journal = JOURNAL_SOCKET if journal_stream(os.environ, _STDERR) else None
        self._log = RunLog(origin, run_dir / LOGS_DIR, journal, clock)
        self._log.__enter__()
        executor.submit(set_at_start, power, profile().power_mode)
        if options.profile_fault:
            _log.error("%s; the run takes %s", options.profile_fault, options.profile)
        for note in options.notes:
            _log.warning("%s", note)
        if self.runtime.orphans:
            _log.warning("ended what a dead run had left: pids %s", self.runtime.orphans)

    def close(self) -> None:
        """End the children that are left, keep the logs, remove the run, restore the signals."""
        self.crew.kill_all()
        self.budgets.close()
        self.switch.close()
        self.serial_workers.close()
        self.notifier.close()
        self.space.close()
        self._log.close()
        self.runtime.close()
        self._give_signals_back()

    def _give_signals_back(self) -> None:
        for number, handler in self._handlers.items():
            signal.signal(number, handler)


def _clock_of_run(options: RunOptions, run_dir: Path) -> Clock:
    """Return CLOCK_MONOTONIC on a robot, the twin's time where a twin moves it."""
    devices_dir = options.devices_dir
    if options.has_twin_time:
        devices_dir = run_dir / "dev"
        devices_dir.mkdir()
        TimePage.create(devices_dir / PAGE_FILE)
    if devices_dir is not None and (devices_dir / PAGE_FILE).exists():
        (run_dir / TIME_LINK).symlink_to(devices_dir)
    clock = clock_of(run_dir)
    if isinstance(clock, TwinClock):
        clock.join(SUPERVISOR, os.getpid())
    return clock


def _handle_stop_signals(on_stop_signal: Callable[[], None]) -> dict[signal.Signals, Any]:
    return {
        number: signal.signal(number, lambda *_: on_stop_signal())
        for number in _STOP_SIGNALS
        if not _is_ignored_hangup(number)
    }


def _is_ignored_hangup(number: int) -> bool:
    """Return whether this was started to outlive the terminal, as by nohup."""
    return number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN
