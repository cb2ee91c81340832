"""Hold everything that exists only between the start and the stop of a run."""

import logging
import os
import signal
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from drivers.clock import Clock, MonotonicClock
from drivers.opener import PathOpener
from drivers.twin_clock import TwinClock, clock_of
from drivers.twin_page import PAGE_FILE, TIME_LINK, TimePage
from platforms import Profile
from platforms.power_switch import PowerSwitch
from vla_deploy.ipc import SharedSpace
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.links import device_links
from vla_deploy.runtime.executors import InlineExecutor, low_priority_thread
from vla_deploy.runtime.journal import JOURNAL_SOCKET
from vla_deploy.runtime.logs import LOGS_DIR, LogOrigin, RunLog, journal_stream
from vla_deploy.runtime.twin_members import SUPERVISOR
from vla_deploy.supervisor.activity_writer import ActivityWriter
from vla_deploy.supervisor.battery import BatteryKeeper, open_battery
from vla_deploy.supervisor.budgets import open_keeper
from vla_deploy.supervisor.health import Health
from vla_deploy.supervisor.power_relay import PowerRelayFeed
from vla_deploy.supervisor.processes.crash_reports import CrashReports, crash_folder
from vla_deploy.supervisor.processes.process_manager import ProcessManager
from vla_deploy.supervisor.profiles.profile_choice import choice_of
from vla_deploy.supervisor.profiles.profile_switch import ProfileSwitch, set_at_start
from vla_deploy.supervisor.report import ProcessTableWriter
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.runtime import Runtime, default_base
from vla_deploy.supervisor.runs.serial_workers import SerialWorkers
from vla_deploy.supervisor.systemd import Notifier, NotifyTarget
from vla_deploy.supervisor.table import ProcessSpec

_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_STDERR = 2
_log = logging.getLogger(__name__)


class Run:
    """Own the run's directory, its shared memory, its children and what reports on them."""

    def __init__(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...],
        clock: Clock | None,
        profile: Callable[[], Profile],
        notify: NotifyTarget,
        on_stop_signal: Callable[[], None],
        robot: RobotDescription,
    ) -> None:
        with ExitStack() as opened:
            opened.callback(_restore_signals, _handle_stop_signals(on_stop_signal))
            self.runtime = Runtime(options.runtime_base or default_base())
            opened.callback(self.runtime.close)
            run_dir = self.runtime.run_dir
            self.clock = clock = clock or _clock_of_run(options, run_dir)
            """The clock of the run, by which its processes live."""
            origin = LogOrigin(process="supervisor", robot=options.robot, run_id=run_dir.name)
            journal = JOURNAL_SOCKET if journal_stream(os.environ, _STDERR) else None
            opened.enter_context(RunLog(origin, run_dir / LOGS_DIR, journal, clock))
            self.space = SharedSpace(run_dir / "ipc", clock)
            opened.callback(self.space.close)
            # The kernel's workers and systemd go by the wall clock, whatever time the robot has.
            self.notifier = Notifier(notify, MonotonicClock())
            opened.callback(self.notifier.close)
            self.serial_workers = SerialWorkers(MonotonicClock())
            opened.callback(self.serial_workers.close)
            self.budgets = open_keeper(
                profile, self.space, clock, self.runtime.state_dir, options.probe_root
            )
            opened.callback(self.budgets.close)
            self.battery = self._open_battery(options, robot)
            if self.battery is not None:
                opened.callback(self.battery.close)
            self.power_relay = self._open_relay(options, robot)
            if self.power_relay is not None:
                opened.callback(self.power_relay.close)
            self.switch = self._open_switch(options, profile())
            opened.callback(self.switch.close)
            self.processes = ProcessManager(
                table, options, run_dir, self.space, clock, profile, robot.ros
            )
            opened.callback(self.processes.kill_all)
            self.report = ProcessTableWriter(run_dir.name, options, self.space, clock)
            self.activity = ActivityWriter(self.space, clock)
            self.health = Health(self.space, clock, lambda: profile().control_rate_hz)
            crashes = crash_folder(self.runtime.state_dir)
            self.crashes = CrashReports(crashes, run_dir, options, self.space, clock)
            self._log_start(options)
            self._opened = opened.pop_all()

    def close(self) -> None:
        """End the children that are left, keep the logs, remove the run, restore the signals."""
        self._opened.close()

    def _open_battery(self, options: RunOptions, robot: RobotDescription) -> BatteryKeeper | None:
        if robot.battery is None:
            return None
        root, executor = options.probe_root, low_priority_thread(self.clock)
        if options.takes_devices:  # the twin's gauge: plain files, not those of this computer
            root = options.devices_dir or self.runtime.run_dir / "dev"
            executor = InlineExecutor()
        return open_battery(robot.battery, self.space, self.clock, root, executor)

    def _open_relay(self, options: RunOptions, robot: RobotDescription) -> PowerRelayFeed | None:
        if robot.power_relay is None:
            return None
        devices_dir = options.devices_dir
        if options.takes_devices and devices_dir is None:
            devices_dir = self.runtime.run_dir / "dev"
        devices = PathOpener(device_links(robot, devices_dir), self.clock)
        return PowerRelayFeed(robot, devices, self.space, self.clock)

    def _open_switch(self, options: RunOptions, profile: Profile) -> ProfileSwitch:
        power, executor = PowerSwitch(), low_priority_thread(self.clock)
        executor.submit(set_at_start, power, profile.power_mode)
        return ProfileSwitch(
            options.profile,
            profile,
            self.space,
            self.clock,
            choice_of(options.runtime_base),
            power,
            executor,
            on_change=self.budgets.adopt,
            fault=options.profile_fault,
        )

    def _log_start(self, options: RunOptions) -> None:
        if options.profile_fault:
            _log.error("%s; the run takes %s", options.profile_fault, options.profile)
        for note in options.notes:
            _log.warning("%s", note)
        if self.runtime.orphans:
            _log.warning("ended what a dead run had left: pids %s", self.runtime.orphans)


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


def _restore_signals(handlers: Mapping[signal.Signals, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


def _is_ignored_hangup(number: int) -> bool:
    """Return whether this was started to outlive the terminal, as by nohup."""
    return number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN
