"""Switch to another release, prove it, or go back: a pure table of steps, and what they do."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from drivers.clock import Clock
from vla_deploy.install.commands import run_command
from vla_deploy.install.errors import ReleaseRefused, SwitchFailed, SystemCommandFailed
from vla_deploy.install.release_store import ReleaseStore
from vla_deploy.install.service_control import ServiceControl, known_trouble, trouble_within

_log = logging.getLogger(__name__)


class Step(StrEnum):
    """Name what is done, in this order when nothing fails."""

    CHECK = "check that the new release runs"
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
NEXT: Final[Mapping[Step, tuple[Step | End, Step | End]]] = {
    Step.CHECK: (Step.MARK, End.REFUSED),
    Step.MARK: (Step.SWAP, Step.SWAP_BACK),
    Step.SWAP: (Step.RESTART, Step.SWAP_BACK),
    Step.RESTART: (Step.WATCH, Step.SWAP_BACK),
    Step.WATCH: (Step.CONFIRM, Step.SWAP_BACK),
    Step.CONFIRM: (Step.PRUNE, Step.SWAP_BACK),
    Step.PRUNE: (End.SWITCHED, End.SWITCHED),
    Step.SWAP_BACK: (Step.RESTART_BACK, End.DOWN),
    Step.RESTART_BACK: (Step.WATCH_BACK, End.DOWN),
    Step.WATCH_BACK: (End.ROLLED_BACK, End.DOWN),
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
        self.do: dict[Step, Callable[[], None]] = {
            Step.CHECK: self._check,
            Step.MARK: self._mark,
            Step.SWAP: lambda: store.use(plan.to),
            Step.RESTART: self._restart,
            Step.WATCH: self._watch,
            Step.CONFIRM: self._confirm,
            Step.PRUNE: lambda: _log.info("removed: %s", store.prune(plan.keep)),
            Step.SWAP_BACK: self._swap_back,
            Step.RESTART_BACK: self._restart,
            Step.WATCH_BACK: self._watch,
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
        step: Step | End = Step.CHECK
        while isinstance(step, Step):
            failure = self._failure_of(step)
            failures += [f"{step.value}: {failure}"] if failure else []
            step = NEXT[step][bool(failure)]
        return SwitchReport(end=step, current=self._store.current(), failures=tuple(failures))

    def _failure_of(self, step: Step) -> str:
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
    if is_running(trial.watcher):
        raise ReleaseRefused(
            f"a switch to {trial.to} is going on (process {trial.watcher}); wait for its end"
        )
    store.undo_trial(trial)
    return f"an interrupted switch to {trial.to} was undone; in use: {trial.origin or 'none'}"
