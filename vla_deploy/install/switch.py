"""Switch to another release, watch the service, keep the release or go back: a table of steps."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Final, Protocol

from drivers.clock import NS_PER_S, Clock
from vla_deploy.install.commands import run_command
from vla_deploy.install.errors import ReleaseRefused, SwitchFailed, SystemCommandFailed
from vla_deploy.install.layout import SERVICE, SERVICE_RUNTIME
from vla_deploy.install.releases import ReleaseStore
from vla_deploy.install.robot_report import Report, moving_in, robot_report, tick_of
from vla_deploy.supervisor.systemd import trouble_in

_POLL_NS: Final = NS_PER_S // 5
_ASK_NS: Final = 3 * NS_PER_S  # asking keeps a core busy for a second
_SILENT_NS: Final = 8 * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceState:
    """Say whether the service is ready, which process it is after how many restarts, in its words.

    `status` is its own account of its processes, "" where it gives none.
    """

    active: str
    main_pid: int
    restarts: int
    status: str = ""


class ServiceControl(Protocol):
    """Restart one service, return its state, and ask the robot that it runs."""

    def restart(self) -> None:
        """Restart it; return when it is ready.

        Raises:
            SystemCommandFailed: it did not become ready.
        """

    def state(self) -> ServiceState:
        """Return its state.

        Raises:
            SystemCommandFailed: the service manager does not answer.
        """

    def report(self) -> Report:
        """Return the robot's own status, by the program of the release that is in use.

        Raises:
            SystemCommandFailed: the robot is not reached.
        """


class SystemdService:
    """Restart the robot's service by systemctl; `program` is that of the release in use."""

    def __init__(self, program: Path, unit: str = SERVICE, runtime: Path = SERVICE_RUNTIME) -> None:
        self._program = program
        self._unit = unit
        self._runtime = runtime

    def restart(self) -> None:
        """Restart it, also when it had been given up; return when it is ready."""
        run_command(["systemctl", "reset-failed", self._unit])
        run_command(["systemctl", "restart", self._unit])

    def state(self) -> ServiceState:
        """Return its state."""
        properties = "--property=ActiveState,MainPID,NRestarts,StatusText"
        text = run_command(["systemctl", "show", properties, self._unit])
        values = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
        try:
            return ServiceState(
                active=values["ActiveState"],
                main_pid=int(values["MainPID"]),
                restarts=int(values["NRestarts"]),
                status=values.get("StatusText", ""),
            )
        except (KeyError, ValueError) as error:
            raise SystemCommandFailed(
                f"systemctl show {self._unit}: cannot read {text!r}"
            ) from error

    def report(self) -> Report:
        """Return the robot's own status."""
        return robot_report(self._program, self._runtime)


class _TickWatch:
    """Ask the robot now and then; its control has to have gone on since."""

    def __init__(self, service: ServiceControl, clock: Clock) -> None:
        self._service = service
        self._clock = clock
        self._tick: int | None = None
        self._silence = "not asked yet"
        self._ask_ns = self._well_ns = clock.now_ns()
        self.has_ticked = False

    def trouble(self) -> str:
        """Return why control is not known to go on, "" while it is or may still answer."""
        if self._clock.now_ns() >= self._ask_ns:
            self._ask()
            self._ask_ns = self._clock.now_ns() + _ASK_NS
        is_silent = self._clock.now_ns() - self._well_ns >= _SILENT_NS
        return self._silence if is_silent else ""

    def _ask(self) -> None:
        try:
            tick = tick_of(self._service.report())
        except SystemCommandFailed as error:
            self._silence = f"the robot cannot be reached: {error}"
            return
        if tick is None:
            self._silence = "control is silent"
        elif tick == self._tick:
            self._silence = f"control stands still at tick {tick}"
        else:
            self.has_ticked = self._tick is not None
            self._tick, self._well_ns = tick, self._clock.now_ns()


def trouble_within(service: ServiceControl, clock: Clock, healthy_s: float, known: str = "") -> str:
    """Watch a service that is ready; return what went wrong, empty when it stays well.

    Well means that the robot answers and its control ticks on. systemd restarts what fails or
    misses its watchdog: another process is a failure. A process of the robot that fails or is late
    is one, too, unless the trouble was `known` before.

    Raises:
        SystemCommandFailed: the service manager does not answer.
    """
    first = now = service.state()
    if first.active != "active":
        return f"the service is {first.active}, expected active"
    end_ns = clock.now_ns() + round(healthy_s * NS_PER_S)
    ticks = _TickWatch(service, clock)
    while True:
        if replace(now, status=first.status) != first:
            return f"it became {now.active} after {now.restarts - first.restarts} restarts"
        if trouble_in(now.status) not in ("", known):
            return f"it says: {now.status}"
        if trouble := ticks.trouble():
            return trouble
        if clock.now_ns() >= end_ns and ticks.has_ticked:
            return ""
        clock.sleep_until(clock.now_ns() + _POLL_NS)
        now = service.state()


def motion_of(service: ServiceControl) -> str:
    """Return what moves, "" for a robot at rest or one that does not run.

    What is not ready and does not answer is taken for one that does not run: a service that fails
    again and again has to be replaceable.
    """
    try:
        is_ready = service.state().active == "active"
    except SystemCommandFailed:
        is_ready = False
    try:
        return moving_in(service.report())
    except SystemCommandFailed as error:
        return f"the robot does not answer: {error}" if is_ready else ""


def known_trouble(service: ServiceControl) -> str:
    """Return the trouble that a service has already; none where it does not run or answer."""
    try:
        now = service.state()
    except SystemCommandFailed:
        return ""
    return trouble_in(now.status) if now.active == "active" else ""


_log = logging.getLogger(__name__)


class SwitchStep(StrEnum):
    """Name what is done, in this order when nothing fails."""

    CHECK = "check that the new release runs"
    REST = "check that nothing moves"
    MARK = "write down what to go back to"
    SWAP = "put it in use"
    RESTART = "restart the service"
    WATCH = "watch its health"
    CONFIRM = "keep it"
    PRUNE = "remove old releases"
    SWAP_BACK = "put the previous release in use again"
    RESTART_BACK = "restart the service with the previous release"
    WATCH_BACK = "watch the previous release's health"


class End(StrEnum):
    """Name how a switch ends."""

    SWITCHED = "switched"
    REFUSED = "refused"
    ROLLED_BACK = "rolled back"
    DOWN = "rolled back, and the service is down"


# What follows a step that succeeded, and one that failed.
NEXT: Final[Mapping[SwitchStep, tuple[SwitchStep | End, SwitchStep | End]]] = {
    SwitchStep.CHECK: (SwitchStep.REST, End.REFUSED),
    SwitchStep.REST: (SwitchStep.MARK, End.REFUSED),
    SwitchStep.MARK: (SwitchStep.SWAP, SwitchStep.SWAP_BACK),
    SwitchStep.SWAP: (SwitchStep.RESTART, SwitchStep.SWAP_BACK),
    SwitchStep.RESTART: (SwitchStep.WATCH, SwitchStep.SWAP_BACK),
    SwitchStep.WATCH: (SwitchStep.CONFIRM, SwitchStep.SWAP_BACK),
    SwitchStep.CONFIRM: (SwitchStep.PRUNE, SwitchStep.SWAP_BACK),
    SwitchStep.PRUNE: (End.SWITCHED, End.SWITCHED),
    SwitchStep.SWAP_BACK: (SwitchStep.RESTART_BACK, End.DOWN),
    SwitchStep.RESTART_BACK: (SwitchStep.WATCH_BACK, End.DOWN),
    SwitchStep.WATCH_BACK: (End.ROLLED_BACK, End.DOWN),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchPlan:
    """Choose the release, what must run before it is used, and how long it must stay well."""

    to: str
    robot: str
    profile: str
    healthy_s: float = 20.0
    keep: int = 3

    def self_tests(self) -> tuple[tuple[str, ...], ...]:
        """Return what the new release must be able to do, as its arguments."""
        return (("check", "--robot", self.robot, "--profile", self.profile),)


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchReport:
    """Say how a switch ended, which release is in use, and what failed on the way."""

    end: End
    current: str
    failures: tuple[str, ...] = ()


class Switch:
    """Carry one switch out; `service` is None where no service runs, as in an image's folder."""

    def __init__(
        self, store: ReleaseStore, plan: SwitchPlan, service: ServiceControl | None, clock: Clock
    ) -> None:
        self._store = store
        self._plan = plan
        self._service = service
        self._clock = clock
        self._origin = store.current()
        self._known_trouble = ""
        self.do: dict[SwitchStep, Callable[[], None]] = {
            SwitchStep.CHECK: self._check,
            SwitchStep.REST: self._rest,
            SwitchStep.MARK: self._mark,
            SwitchStep.SWAP: lambda: store.use(plan.to),
            SwitchStep.RESTART: self._restart,
            SwitchStep.WATCH: self._watch,
            SwitchStep.CONFIRM: self._confirm,
            SwitchStep.PRUNE: lambda: _log.info("removed: %s", store.prune(plan.keep)),
            SwitchStep.SWAP_BACK: self._swap_back,
            SwitchStep.RESTART_BACK: self._restart,
            SwitchStep.WATCH_BACK: self._watch,
        }

    def run(self) -> SwitchReport:
        """Go through the steps to an end.

        Raises:
            ReleaseRefused: there is no such release, or it is in use already.
        """
        self._store.folder(self._plan.to)
        if self._plan.to == self._origin:
            raise ReleaseRefused(f"release {self._plan.to} is in use already")
        failures: list[str] = []
        step: SwitchStep | End = SwitchStep.CHECK
        while isinstance(step, SwitchStep):
            failure = self._failure_of(step)
            failures += [f"{step.value}: {failure}"] if failure else []
            step = NEXT[step][bool(failure)]
        return SwitchReport(end=step, current=self._store.current(), failures=tuple(failures))

    def _failure_of(self, step: SwitchStep) -> str:
        _log.info("%s", step.value)
        try:
            self.do[step]()
        except (SystemCommandFailed, ReleaseRefused, SwitchFailed, OSError) as error:
            return str(error)
        return ""

    def _check(self) -> None:
        program = str(self._store.folder(self._plan.to) / "bin" / "vla-deploy")
        for arguments in self._plan.self_tests():
            run_command([program, *arguments])

    def _rest(self) -> None:
        moving = motion_of(self._service) if self._service is not None else ""
        if moving:
            raise ReleaseRefused(
                f"expected a robot at rest, got: {moving}; a restart takes the arms' power: end "
                "the work first (vla-deploy stop), or the service (sudo systemctl stop vla-deploy)"
            )

    def _mark(self) -> None:
        if self._service is not None:
            self._known_trouble = known_trouble(self._service)
        self._store.begin_trial(self._plan.to)

    def _restart(self) -> None:
        if self._service is not None and self._store.current():
            self._service.restart()

    def _watch(self) -> None:
        if self._service is None or not self._store.current():
            return
        trouble = trouble_within(
            self._service, self._clock, self._plan.healthy_s, self._known_trouble
        )
        if trouble:
            raise SwitchFailed(trouble)

    def _confirm(self) -> None:
        self._store.remember_previous(self._origin)
        self._store.end_trial()

    def _swap_back(self) -> None:
        self._store.use(self._origin)
        self._store.end_trial()


def recover(store: ReleaseStore, is_running: Callable[[int], bool]) -> str:
    """End a trial whose watcher has ended, by going back; return what was done, else nothing.

    Raises:
        ReleaseRefused: a switch is going on.
    """
    trial = store.trial()
    if trial is None:
        return ""
    if trial.boot == store.boot() and is_running(trial.watcher):  # a pid means nothing later
        raise ReleaseRefused(
            f"a switch to {trial.to} is going on (process {trial.watcher}); wait for its end"
        )
    store.undo_trial(trial)
    return f"an interrupted switch to {trial.to} was undone; in use: {trial.origin or 'none'}"
