"""Take the running robot to another profile: prepare, commit, watch, keep - or go back."""

import itertools
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Final, Literal

import psutil

from drivers.clock import NS_PER_S, Clock
from platforms import Profile, ProfileError
from platforms.power_switch import PowerSwitch
from platforms.profile import profile_from
from platforms.profile_source import read_source
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.supervisor.profiles.profile_change import (
    LIMITS_S,
    RESTART_S,
    ChangeOutcome,
    ChangePhase,
    Member,
    ProfileChange,
    ProfileReport,
    ProfileRequest,
)
from vla_deploy.supervisor.profiles.profile_choice import ProfileChoice
from vla_deploy.supervisor.profiles.profile_trial import ProfileTrial

CONTROL: Final = "control"
_MB: Final = 1_000_000
_DISARMED: Final = "disarmed"
_log = logging.getLogger(__name__)


class ProfileSwitch:
    """Own the profile that is in force; `profile` names what a process that starts now gets.

    All or none of the processes change. Until a change is kept nothing is written to disk, so that
    a supervisor that ends in between leaves the old profile.
    """

    def __init__(
        self,
        name: str,
        profile: Profile,
        space: SharedSpace,
        clock: Clock,
        choice: ProfileChoice,
        power: PowerSwitch,
        executor: Executor,
        watch_s: float = LIMITS_S[ChangePhase.WATCH],
        on_change: Callable[[Profile], None] | None = None,
        fault: str = "",
    ) -> None:
        """Listen from now on; after a commit everything is watched for `watch_s`.

        `on_change` gets the profile in force before the processes do; `fault` is why the profile
        is not the chosen one, until another one is kept.
        """
        self.fault = fault
        self.profile = self._kept = name
        self.in_force = self._kept_profile = profile
        self._clock = clock
        self._choice = choice
        self._power = power
        self._executor = executor
        self._limits_s = {**LIMITS_S, ChangePhase.WATCH: watch_s}
        self._on_change = on_change
        self._power_set: Future[str] | None = None
        self._requests = space.ring_reader(topics.PROFILE_REQUEST, from_start=False)
        self._changes = space.ring_writer(topics.PROFILE_CHANGE)
        self._answers = space.ring_reader(topics.PROFILE_ANSWER, from_start=False)
        self._report = ProfileReport(space, clock, begun_with=name)
        self._trial = ProfileTrial(space, clock)
        self._ids = itertools.count(1)
        self._change: ProfileChange | None = None
        self._members: Mapping[str, Member] = {}
        self._runs_under: dict[tuple[str, int], str] = {}
        """The profile that a process, by name and pid, took over while it ran; "" where unknown."""
        self._phases: Mapping[ChangePhase, Callable[[ProfileChange], None]] = {
            ChangePhase.PREPARE: self._preparing,
            ChangePhase.SET_POWER: self._setting_power,
            ChangePhase.COMMIT: self._committing,
            ChangePhase.WATCH: self._watching,
            ChangePhase.VALIDATE: self._validating,
            ChangePhase.ROLLBACK: self._rolling_back,
        }

    def step(self, members: Mapping[str, Member], absent: Mapping[str, str]) -> tuple[str, ...]:
        """Go on; return which processes are to be started again.

        `members` are ready and follow profiles, `absent` are starting, with their state.
        """
        self._members = members
        for event in self._requests.drain():
            self._take(ProfileRequest.of(event.payload), absent)
        answers = [event.payload for event in self._answers.drain()]
        change = self._change
        if change is not None:
            for answer in answers:
                change.note(answer)
            self._look_for_dead(change)
            self._phases[change.phase](change)
        self._report.publish(self._kept, self._change, self.fault)
        return self._strangers() if change is None else self._to_restart(change)

    def close(self) -> None:
        """Give up what the executor runs."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    # --- a request ----------------------------------------------------------------------------

    def _take(self, request: ProfileRequest, absent: Mapping[str, str]) -> None:
        try:
            source = read_source(request.profile)
            target = profile_from(source)
            self._refuse_if_busy(absent)
            self._power.check(target.power_mode)
            _refuse_small_computer(target)
        except ProfileError as error:
            self._report.conclude(request, ChangeOutcome.REFUSED, "; ".join(error.faults), 0.0)
            return
        self._trial.begin()
        self._change = ProfileChange(
            change_id=next(self._ids),
            request=request,
            target=target,
            pids={name: member.pid for name, member in self._members.items()},
            began_ns=self._clock.now_ns(),
        )
        self._enter(self._change, ChangePhase.PREPARE)
        self._changes.publish(
            {
                "change_id": self._change.change_id,
                "phase": "prepare",
                "profile": request.profile,
                "values": source.values,
            }
        )

    def _refuse_if_busy(self, absent: Mapping[str, str]) -> None:
        if self._change is not None:
            running = self._change.request.profile
            raise ProfileError((f"a change to {running} is under way: wait for its end",))
        if absent:
            states = ", ".join(f"{name} is {state}" for name, state in absent.items())
            raise ProfileError((f"{states}: wait until it is ready",))

    # --- phases -------------------------------------------------------------------------------

    def _preparing(self, change: ProfileChange) -> None:
        if self._is_waiting(change):
            return
        refusals = self._settle_restarts(change)
        if refusals or change.request.dry_run:
            self._go_back(change, _listed(refusals))
            return
        change.power_before = self._power.current() if change.target.power_mode else ""
        self._enter(change, ChangePhase.SET_POWER)
        self._power_set = self._executor.submit(self._power.set, change.target.power_mode)

    def _settle_restarts(self, change: ProfileChange) -> dict[str, str]:
        """Set aside the processes that may be restarted; return the refusals that remain."""
        refusals = dict(change.refusals)
        for name, reason in change.refusals.items():
            if not change.answers[name]["restart"]:
                continue
            if not change.request.allow_restart:
                refusals[name] = f"needs a restart: {reason}; permit it with --allow-restart"
            elif name == CONTROL and not self._is_disarmed:
                refusals[name] = f"needs a restart: {reason}; disarm first"
            else:
                change.restarts[name] = change.answers[name]["pace_ratio"]
                del refusals[name]
        return refusals

    def _setting_power(self, change: ProfileChange) -> None:
        assert self._power_set is not None
        if not self._power_set.done():
            if self._is_late(change):
                self._go_back(change, f"power mode {change.target.power_mode}: not set in time")
            return
        if failure := self._power_set.result():
            self._go_back(change, failure)
            return
        change.committed = True
        self._put_in_force(change.request.profile, change.target)
        self._enter(change, ChangePhase.COMMIT, RESTART_S if change.restarts else None)
        self._publish(change, "commit")

    def _committing(self, change: ProfileChange) -> None:
        pids = {name: member.pid for name, member in self._members.items()}
        restarting = tuple(
            name for name in change.restarts if name not in pids or pids[name] == change.pids[name]
        )
        if self._is_waiting(change, restarting):
            return
        if change.refusals:
            self._go_back(change, _listed(change.refusals))
            return
        restarted = change.settle(pids)
        self._trial.begin()
        self._watch(change, restarted, [])

    def _watching(self, change: ProfileChange) -> None:
        if self._is_late(change):
            self._enter(change, ChangePhase.VALIDATE)
            self._publish(change, "validate")

    def _validating(self, change: ProfileChange) -> None:
        if self._is_waiting(change):
            return
        faults, slow = [*self._trial.faults(change.target)], change.refusals
        if slow and not (faults or change.was_slow or CONTROL in slow):
            change.was_slow = True
            self._watch(change, {}, [*slow])
            return
        faults += [_listed(slow)] if slow else []
        if faults:
            self._go_back(change, "; ".join(faults))
            return
        self._keep(change)

    def _keep(self, change: ProfileChange) -> None:
        try:
            self._choice.save(change.request.profile)
        except OSError as error:
            self._go_back(change, f"{self._choice.path}: {error.strerror}")
            return
        self._publish(change, "keep")
        self._kept, self._kept_profile = self.profile, self.in_force
        self.fault = ""
        self._runs_under = dict.fromkeys(change.pids.items(), self.profile)
        self._end(change, ChangeOutcome.KEPT, "")

    def _rolling_back(self, change: ProfileChange) -> None:
        power = self._power_set
        is_waiting = change.silent or (power is not None and not power.done())
        if is_waiting and not self._is_late(change):
            return
        reason = change.failure
        if change.silent:
            reason += f"; {', '.join(change.silent)} did not go back and is started again"
            self._runs_under |= {(name, change.pids[name]): "" for name in change.silent}
        if power is not None and power.done() and power.result():
            reason += f"; {power.result()}"
        self._power_set = None
        if change.request.dry_run and not reason:
            self._end(change, ChangeOutcome.WOULD_WORK, _restart_note(change))
        else:
            outcome = ChangeOutcome.ROLLED_BACK if change.committed else ChangeOutcome.REFUSED
            self._end(change, outcome, reason)

    def _go_back(self, change: ProfileChange, failure: str) -> None:
        change.failure = failure
        self._put_in_force(self._kept, self._kept_profile)
        self._power_set = (
            self._executor.submit(self._power.set, change.power_before)
            if change.power_before
            else None
        )
        self._enter(change, ChangePhase.ROLLBACK)
        self._publish(change, "rollback")

    def _put_in_force(self, name: str, profile: Profile) -> None:
        self.profile, self.in_force = name, profile
        if self._on_change is not None:
            self._on_change(profile)

    def _is_late(self, change: ProfileChange) -> bool:
        return self._clock.now_ns() >= change.deadline_ns

    def _is_waiting(self, change: ProfileChange, restarting: tuple[str, ...] = ()) -> bool:
        """Return whether answers may still come; when it is too late for them, go back."""
        missing = (*change.silent, *restarting)
        if missing and self._is_late(change):
            self._go_back(change, f"{', '.join(missing)}: no answer to {change.phase} in time")
        return bool(missing)

    # --- processes that end, and those to start again -----------------------------------------

    def _look_for_dead(self, change: ProfileChange) -> None:
        ended_for_it = change.restarts.keys() if change.committed else frozenset()
        dead = [
            name
            for name, pid in change.pids.items()
            if name not in ended_for_it and not self._is_running(name, pid)
        ]
        for name in dead:
            del change.pids[name]
        if dead and change.phase is not ChangePhase.ROLLBACK:
            self._go_back(change, f"{', '.join(dead)} ended meanwhile")

    def _is_running(self, name: str, pid: int) -> bool:
        return name in self._members and self._members[name].pid == pid

    def _to_restart(self, change: ProfileChange) -> tuple[str, ...]:
        if change.phase is not ChangePhase.COMMIT:
            return ()
        return tuple(name for name in change.restarts if self._is_running(name, change.pids[name]))

    def _strangers(self) -> tuple[str, ...]:
        """Return the processes that may run under another profile, control only when disarmed."""
        return tuple(
            name
            for name, member in self._members.items()
            if self._runs_under.get((name, member.pid), member.started_under) != self.profile
            and (name != CONTROL or self._is_disarmed)
        )

    @property
    def _is_disarmed(self) -> bool:
        return self._trial.control_state == _DISARMED

    # --- publishing ---------------------------------------------------------------------------

    def _enter(
        self, change: ProfileChange, phase: ChangePhase, limit_s: float | None = None
    ) -> None:
        limit_s = self._limits_s[phase] if limit_s is None else limit_s
        change.enter(phase, self._clock.now_ns() + round(limit_s * NS_PER_S))

    def _watch(
        self, change: ProfileChange, restarted: Mapping[str, float], again: list[str]
    ) -> None:
        self._enter(change, ChangePhase.WATCH)
        self._changes.publish(
            {
                "change_id": change.change_id,
                "phase": "watch",
                "profile": change.request.profile,
                "restarted": restarted,
                "again": again,
            }
        )

    def _publish(
        self, change: ProfileChange, phase: Literal["commit", "validate", "keep", "rollback"]
    ) -> None:
        profile = change.request.profile
        self._changes.publish({"change_id": change.change_id, "phase": phase, "profile": profile})

    def _end(self, change: ProfileChange, outcome: ChangeOutcome, reason: str) -> None:
        self._change = None
        took_s = (self._clock.now_ns() - change.began_ns) / NS_PER_S
        self._report.conclude(change.request, outcome, reason, took_s)


def _refuse_small_computer(profile: Profile) -> None:
    has_mb, wants_mb = psutil.virtual_memory().total / _MB, profile.total.memory_mb
    if wants_mb > has_mb:
        text = f"expected at most the {has_mb:.0f} MB that this computer has, got {wants_mb:g}"
        raise ProfileError((f"budgets.total.memory_mb: {text}",))


def _listed(refusals: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in refusals.items())


def _restart_note(change: ProfileChange) -> str:
    return f"with a restart of {', '.join(sorted(change.restarts))}" if change.restarts else ""


def set_at_start(power: PowerSwitch, mode: str) -> None:
    """Set the power mode of the profile that a run starts under, which may take seconds.

    After a failure the robot runs in the mode that there is.
    """
    try:
        power.check(mode)
        failure = power.set(mode)
    except ProfileError as error:
        failure = "; ".join(error.faults)
    if failure:
        _log.warning("degraded: %s", failure)
    elif mode:
        _log.info("power mode %s", mode)
