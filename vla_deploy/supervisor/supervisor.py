"""Bring reality in line with the process table until someone asks to stop."""

import logging
from collections.abc import Mapping
from pathlib import Path

from drivers.clock import NS_PER_S, Clock
from drivers.twin_clock import TwinClock
from platforms import load_profile
from platforms.profile_schema import NODES
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots import load_robot
from vla_deploy.runtime.exit_codes import EXIT_CONFIGURATION, EXIT_DEVICE_ABSENT
from vla_deploy.runtime.open_files import keep_files_private, raise_open_files
from vla_deploy.runtime.power_off import ask_power_off
from vla_deploy.supervisor.errors import (
    DeviceAbsent,
    ProcessGivenUp,
    StartCrashed,
    StartFailed,
    SupervisorError,
)
from vla_deploy.supervisor.power_relay import CONTROL
from vla_deploy.supervisor.processes.lifecycle import (
    SETTLED,
    TROUBLED,
    Action,
    ProcessRecord,
    ProcessState,
    abort,
    reconcile,
    wind_down,
)
from vla_deploy.supervisor.processes.liveness import Vital
from vla_deploy.supervisor.processes.ros_environment import require_environment
from vla_deploy.supervisor.profiles.profile_change import Member
from vla_deploy.supervisor.runs.log_files import complaint, last_words
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.runs.run import Run
from vla_deploy.supervisor.systemd import NotifyTarget, own_target, status_line
from vla_deploy.supervisor.table import GivingUp, ProcessSpec, RunContext, table_of

_PERIOD_NS = NS_PER_S // 20
_REPORT_NS = NS_PER_S // 2
_HELD_UP_NS = 3 * NS_PER_S  # longer than any load explains, shorter than any silence allowed
_ON_THE_WAY = frozenset(
    {ProcessState.WAITING, ProcessState.STARTING, ProcessState.BACKOFF, ProcessState.ABORTING}
)
_REPAIRED_BY_A_PERSON: Mapping[int | None, type[StartFailed]] = {
    EXIT_CONFIGURATION: StartFailed,
    EXIT_DEVICE_ABSENT: DeviceAbsent,
}
_log = logging.getLogger(__name__)


class Supervisor:
    """Start, watch, restart and stop the processes of one run.

    Use it as a context manager: leaving it stops everything in order; by an exception, arms keep
    holding. All calls belong to the main thread, because the kernel ends the children when the
    thread that started them ends.
    """

    def __init__(
        self,
        options: RunOptions,
        table: tuple[ProcessSpec, ...] | None = None,
        clock: Clock | None = None,
        notify: NotifyTarget | None = None,
    ) -> None:
        raise_open_files()  # the processes inherit both, other programs among them
        keep_files_private()
        self.stop_requested = False
        self.profile = load_profile(options.profile)
        """The profile in force."""
        self._robot = load_robot(options.robot)
        self._options = options
        self._table = table = table_of(self._robot) if table is None else table
        self._given_clock = clock
        self._notify = own_target() if notify is None else notify
        self._records = {spec.name: ProcessRecord() for spec in table}
        self._vitals: dict[str, tuple[Vital, ...]] = {}
        self._alarms: frozenset[str] = frozenset()
        self._given_up = FailurePolicy(table)
        self._report_due_ns = 0
        self._stepped_ns: int | None = None
        self._run: Run | None = None

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(self, failure: type[BaseException] | None, *_: object) -> None:
        self.stop(power_off=failure is None)

    @property
    def run_dir(self) -> Path:
        """Return the directory of the run, which must be started."""
        return self._started().runtime.run_dir

    @property
    def clock(self) -> Clock:
        """Return the clock of the run, which must be started."""
        return self._started().clock

    @property
    def space(self) -> SharedSpace:
        """Return the run's shared memory, which must be started."""
        return self._started().space

    def start(self) -> None:
        """Start every process in order and return when all are ready, or a stop is requested.

        Raises:
            AlreadyRunning: another supervisor holds the runtime directory.
            RuntimeUnavailable: the runtime directory cannot be used.
            StartFailed: a process refused to start; everything is stopped again.
            DeviceAbsent: a device did not appear in all tries; everything is stopped again.
            StartCrashed: a process was given up before it was ready; all is stopped again.
            RosNotFound: the robot is driven or moved over ROS, and this computer has none.
        """
        require_environment(self._robot)
        self._run = Run(
            self._options,
            self._table,
            self._given_clock,
            lambda: self.profile,
            self._notify,
            self.request_stop,
            self._robot,
        )
        try:
            self._wait_until_ready()
        except BaseException:
            self.stop(power_off=False)
            raise
        if self._options.arm and not (self.stop_requested or self._robot.read_only):
            _arm(self._run.space)

    def step(self) -> None:
        """Observe and act once; where `run_until_stopped` does not run, call it every 50 ms."""
        self._step(stopping=False)

    def run_until_stopped(self) -> None:
        """Keep the processes running until SIGINT, SIGTERM, SIGHUP or `request_stop`.

        Raises:
            ProcessGivenUp: the robot cannot go on without that process.
        """
        while not self.stop_requested:
            self._pause()
            self.step()
            if self._given_up.end:
                raise ProcessGivenUp(self._given_up.end)

    def request_stop(self) -> None:
        """Make `start` and `run_until_stopped` return soon."""
        self.stop_requested = True

    def stop(self, *, power_off: bool = True) -> None:
        """Stop every process, the last started first, and remove the run; twice is allowed.

        Without `power_off` control keeps the arms powered: nobody asked to switch the robot off.
        """
        if self._run is None:
            return
        self._run.notifier.stopping()
        if power_off:
            _ask_power_off(self._run.runtime.run_dir)
        try:
            while any(
                record.state is not ProcessState.STOPPED for record in self._records.values()
            ):
                self._step(stopping=True)
                self._pause()
        finally:
            self._run.close()
            self._run = None

    def _wait_until_ready(self) -> None:
        while not self.stop_requested:
            self.step()
            for spec in self._table:
                record = self._records[spec.name]
                if (
                    record.state is ProcessState.GIVEN_UP
                    and spec.giving_up is not GivingUp.CARRY_ON
                ):
                    raise self._failure(spec.name, record)
            if self._is_ready():
                return
            self._pause()

    def _is_ready(self) -> bool:
        return all(
            self._records[spec.name].state in SETTLED or spec.giving_up is GivingUp.CARRY_ON
            for spec in self._table
        )

    def _failure(self, name: str, record: ProcessRecord) -> StartFailed:
        kind = _REPAIRED_BY_A_PERSON.get(record.exit_code)
        if kind is not None:
            why = complaint(self.run_dir, name) or record.reason
            return kind(f"{name} did not start: {why}")
        words = last_words(self.run_dir, name)
        return StartCrashed("\n".join([f"{name} did not start: {record.reason}", *words]))

    def _step(self, *, stopping: bool) -> None:
        run, before = self._started(), self._records
        now_ns = run.clock.now_ns()
        self._forgive_when_held_up(now_ns)
        self._records, actions = self._decide(stopping=stopping, now_ns=now_ns)
        run.processes.perform((*actions, *self._abort_over_budget(run, now_ns)))
        run.crashes.note(before, self._records, run.processes.started)
        changed = _log_changes(before, self._records)
        if changed:
            self._given_up.take(self._records, run.space)
        if changed or now_ns >= self._report_due_ns:
            self._report(now_ns)
        run.activity.step(self._given_up.refusal)
        if run.battery is not None:
            run.battery.step()
        if run.power_relay is not None:
            run.power_relay.step(self._records[CONTROL].state, stopping=stopping)
        run.serial_workers.step(wanted=self.profile.realtime_priority > 0)
        run.notifier.step(
            ready=self._is_ready(),
            stopping=stopping,
            status=status_line(self._records, stopping=stopping, fault=run.switch.fault),
            troubles=run.health.troubles(),
        )

    def _decide(
        self, *, stopping: bool, now_ns: int
    ) -> tuple[dict[str, ProcessRecord], tuple[Action, ...]]:
        run = self._started()
        seen = run.processes.observe()
        if stopping:
            return wind_down(self._table, self._records, seen, now_ns=now_ns)
        return reconcile(
            self._table, self._records, seen, unwanted=self._unwanted(run), now_ns=now_ns
        )

    def _abort_over_budget(self, run: Run, now_ns: int) -> list[Action]:
        """Abort the processes that the budgets want started again."""
        actions: list[Action] = []
        for name, reason in run.budgets.step(run.processes.pids()).items():
            if self._records[name].state in (ProcessState.STARTING, ProcessState.READY):
                self._records[name], act = abort(self._records[name], reason, now_ns)
                actions += [(act, name)] if act else []
        return actions

    def _unwanted(self, run: Run) -> dict[str, str]:
        context = RunContext(
            twin=self._options.twin,
            robot=self._robot,
            profile=self.profile,
            suspended=dict.fromkeys(run.budgets.suspended, "suspended by the budgets"),
            ros=self._options.ros,
        )
        reasons = {spec.name: spec.when(context) for spec in self._table}
        return {
            **dict.fromkeys(self._follow_profile(run), "started again for another profile"),
            **{name: reason for name, reason in reasons.items() if reason},
        }

    def _follow_profile(self, run: Run) -> tuple[str, ...]:
        """Go on with a profile change; return the processes that are started again for it."""
        states = {name: self._records[name].state for name in NODES if name in self._records}
        pids = run.processes.pids()
        members = {
            name: Member(pid=pids[name], started_under=run.processes.started_under[name])
            for name, state in states.items()
            if state is ProcessState.READY and name in pids
        }
        absent = {name: state.value for name, state in states.items() if state in _ON_THE_WAY}
        restarts = run.switch.step(members, absent)
        self.profile = run.switch.in_force
        run.processes.profile = run.switch.profile
        return restarts

    def _report(self, now_ns: int) -> None:
        run = self._started()
        if now_ns >= self._report_due_ns:
            self._report_due_ns = now_ns + _REPORT_NS
            vitals = run.processes.examine(run.budgets.rate_ratios)
            # A process that is ending need not write any more.
            self._vitals = {
                name: signs
                for name, signs in vitals.items()
                if self._records[name].state is ProcessState.READY
            }
            run.processes.bound_output()
            self._log_alarms()
        run.report.publish(
            self._records,
            run.processes,
            self._vitals,
            self._given_up.refusal,
            run.budgets.snapshot,
        )

    def _log_alarms(self) -> None:
        """Log an alarm when it is raised, not for as long as it lasts."""
        alarms = {
            f"{name}: {vital.topic}": alarm
            for name, vitals in self._vitals.items()
            for vital in vitals
            for alarm in vital.alarms
        }
        for where in alarms.keys() - self._alarms:
            _log.warning("%s", alarms[where])
        for where in self._alarms - alarms.keys():
            _log.info("%s: in order again", where)
        self._alarms = frozenset(alarms)

    def _forgive_when_held_up(self, now_ns: int) -> None:
        """Forgive silence after this process was held up: the others may have been, too."""
        stepped_ns, self._stepped_ns = self._stepped_ns, now_ns
        if stepped_ns is not None and now_ns - stepped_ns > _HELD_UP_NS:
            _log.warning("the supervisor was held up for %.1f s", (now_ns - stepped_ns) / NS_PER_S)
            self._started().processes.forgive_silence()

    def _pause(self) -> None:
        clock = self.clock
        sleep = clock.sleep_until_governed if isinstance(clock, TwinClock) else clock.sleep_until
        sleep(clock.now_ns() + _PERIOD_NS)

    def _started(self) -> Run:
        if self._run is None:
            raise SupervisorError("the run is not started: call start() first")
        return self._run


class FailurePolicy:
    """Do what the table declares for processes that were given up.

    `end` is why the run must end, `refusal` why no command is taken; "" where nothing is.
    """

    def __init__(self, table: tuple[ProcessSpec, ...]) -> None:
        self.end = ""
        self.refusal = ""
        self._table = table
        self._known: set[str] = set()

    def take(self, records: Mapping[str, ProcessRecord], space: SharedSpace) -> None:
        """Act on every process that is newly given up."""
        for spec in self._table:
            record = records[spec.name]
            if record.state is ProcessState.GIVEN_UP and spec.name not in self._known:
                self._known.add(spec.name)
                self._take(spec, f"{spec.name} was given up: {record.reason}", space)

    def _take(self, spec: ProcessSpec, why: str, space: SharedSpace) -> None:
        _log.error("%s; %s", why, spec.giving_up.value)
        if spec.giving_up is GivingUp.END_RUN:
            self.end = f"{why}; see: vla-deploy crashes list"
        elif spec.giving_up is GivingUp.NO_COMMANDS:
            self.refusal = f"{why}; see: vla-deploy crashes list, then start the run anew"
            # The planner may be the one that is gone: the executor gets the cancel directly.
            space.ring_writer(topics.PLAN).publish({"command_id": "supervisor", "cancel": True})


def _arm(space: SharedSpace) -> None:
    space.ring_writer(topics.OPERATOR).publish(
        {"act": "arm", "source": "supervisor", "reason": "asked for by --arm"}
    )


def _ask_power_off(run_dir: Path) -> None:
    try:
        ask_power_off(run_dir)
    except OSError as error:
        _log.warning("%s: arms keep holding: %s", run_dir, error)


def _log_changes(before: Mapping[str, ProcessRecord], after: Mapping[str, ProcessRecord]) -> bool:
    changed = [name for name, record in after.items() if record.state is not before[name].state]
    for name in changed:
        record = after[name]
        level = logging.WARNING if record.state in TROUBLED else logging.INFO
        _log.log(
            level, "%s: %s%s", name, record.state.value, record.reason and f" ({record.reason})"
        )
    return bool(changed)
