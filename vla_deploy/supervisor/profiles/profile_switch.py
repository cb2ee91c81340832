"""Take the running robot to another profile: prepare, commit, watch, keep - or go back."""

import itertools
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Final

import psutil

from drivers.clock import NS_PER_S, Clock
from platforms import Profile, ProfileError
from platforms.power_switch import PowerSwitch
from platforms.profile import profile_from
from platforms.profile_source import read_source
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.profiles import profile_change
from vla_deploy.supervisor.profiles.profile_change import (
    ChangeOutcome,
    ChangePhase,
    Member,
    ProfileChange,
    ProfileRequest,
)
from vla_deploy.supervisor.profiles.profile_choice import ProfileChoice
from vla_deploy.supervisor.profiles.profile_members import CONTROL, Allegiance
from vla_deploy.supervisor.profiles.profile_report import ProfileReport
from vla_deploy.supervisor.profiles.profile_trial import ProfileTrial

_MB: Final = 1_000_000
_DISARMED: Final = "disarmed"


class ProfileSwitch:
    """Own the profile that is in force; `profile` names what a process that starts now gets.

    All or none of the processes change. Until a change is kept nothing is written down, so that a
    supervisor that ends meanwhile leaves the old profile.
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
        watch_s: float = profile_change.WATCH_S,
        on_change: Callable[[Profile], None] | None = None,
        fault: str = "",
    ) -> None:
        """Listen from now on; after a commit everything is watched for `watch_s`.

        `on_change` hears which profile is in force before the processes do; `fault` tells why the
        profile is not the chosen one, until another one is kept.
        """
        self.fault = fault
        self.profile = self._kept = name
        self.in_force = self._kept_profile = profile
        self._clock = clock
        self._choice = choice
        self._power = power
        self._executor = executor
        self._watch_ns = _ns(watch_s)
        self._on_change = on_change
        self._power_set: Future[str] | None = None
        self._requests = space.ring_reader("profile_request", from_start=False)
        self._changes = space.ring_writer("profile_change")
        self._answers = space.ring_reader("profile_answer", from_start=False)
        self._report = ProfileReport(space, clock, begun_with=name)
        self._trial = ProfileTrial(space, clock)
        self._ids = itertools.count(1)
        self._change: ProfileChange | None = None
        self._allegiance = Allegiance()
        self._phases: Mapping[
            ChangePhase, Callable[[ProfileChange, Mapping[str, Member]], None]
        ] = {
            ChangePhase.PREPARE: self._preparing,
            ChangePhase.SET_POWER: self._setting_power,
            ChangePhase.COMMIT: self._committing,
            ChangePhase.WATCH: self._watching,
            ChangePhase.VALIDATE: self._validating,
            ChangePhase.ROLLBACK: self._rolling_back,
        }

    def step(self, members: Mapping[str, Member], absent: Mapping[str, str]) -> tuple[str, ...]:
        """Go on; return which processes are to be started again.

        `members` are ready and follow profiles, `absent` are on their way up, with their state.
        """
        for event in self._requests.drain():
            self._take(ProfileRequest.of(event.payload), members, absent)
        answers = [event.payload for event in self._answers.drain()]
        change = self._change
        if change is None:
            self._report.tell(self._kept, self._change, self.fault)
            return self._allegiance.strangers(
                members, self.profile, may_restart_control=self._trial.control_state == _DISARMED
            )
        for answer in answers:
            change.note(answer)
        self._look_for_dead(change, members)
        self._phases[change.phase](change, members)
        self._report.tell(self._kept, self._change, self.fault)
        return self._to_restart(change, members)

    def close(self) -> None:
        """Give up what the executor runs."""
        self._executor.shutdown(wait=False, cancel_futures=True)

    # --- a request ----------------------------------------------------------------------------

    def _take(
        self, request: ProfileRequest, members: Mapping[str, Member], absent: Mapping[str, str]
    ) -> None:
        try:
            source = read_source(request.profile)
            target = profile_from(source)
            self._refuse_if_busy(absent)
            self._power.check(target.power_mode)
            _refuse_small_computer(target)
        except ProfileError as error:
            self._report.conclude(request, ChangeOutcome.REFUSED, "; ".join(error.faults), 0.0)
            return
        now_ns = self._clock.now_ns()
        self._trial.begin()
        change = ProfileChange(
            change_id=next(self._ids),
            request=request,
            target=target,
            values=source.values,
            pids={name: member.pid for name, member in members.items()},
            began_ns=now_ns,
            deadline_ns=now_ns + _ns(profile_change.PREPARE_S),
        )
        self._change = change
        self._publish(change, "prepare", values=change.values)

    def _refuse_if_busy(self, absent: Mapping[str, str]) -> None:
        if self._change is not None:
            running = self._change.request.profile
            raise ProfileError((f"a change to {running} is under way: wait for its end",))
        if absent:
            states = ", ".join(f"{name} is {state}" for name, state in absent.items())
            raise ProfileError((f"{states}: wait until it is ready",))

    # --- phases -------------------------------------------------------------------------------

    def _preparing(self, change: ProfileChange, _: Mapping[str, Member]) -> None:
        if self._is_waiting(change):
            return
        refusals = self._settle_restarts(change)
        if refusals:
            self._go_back(change, _listed(refusals))
        elif change.request.dry_run:
            self._go_back(change, "")
        else:
            self._set_power(change)

    def _settle_restarts(self, change: ProfileChange) -> dict[str, str]:
        """Set aside who may be restarted, and return the refusals that remain."""
        refusals = dict(change.refusals)
        for name, reason in change.refusals.items():
            if not change.answers[name]["restart"]:
                continue
            if not change.request.allow_restart:
                refusals[name] = f"needs a restart: {reason}; permit it with --allow-restart"
            elif name == CONTROL and self._trial.control_state != _DISARMED:
                refusals[name] = f"needs a restart: {reason}; disarm first"
            else:
                change.restarts[name] = change.answers[name]["pace_ratio"]
                del refusals[name]
        return refusals

    def _set_power(self, change: ProfileChange) -> None:
        change.enter(ChangePhase.SET_POWER, self._clock.now_ns(), _ns(profile_change.SET_POWER_S))
        change.power_before = self._power.current() if change.target.power_mode else ""
        self._power_set = self._executor.submit(self._power.set, change.target.power_mode)

    def _setting_power(self, change: ProfileChange, _: Mapping[str, Member]) -> None:
        assert self._power_set is not None
        if not self._power_set.done():
            if self._clock.now_ns() >= change.deadline_ns:
                self._go_back(change, f"power mode {change.target.power_mode}: not set in time")
            return
        failure = self._power_set.result()
        if failure:
            self._go_back(change, failure)
            return
        self._commit(change)

    def _commit(self, change: ProfileChange) -> None:
        change.committed = True
        self._put_in_force(change.request.profile, change.target)
        limit_s = profile_change.RESTART_S if change.restarts else profile_change.COMMIT_S
        change.enter(ChangePhase.COMMIT, self._clock.now_ns(), _ns(limit_s))
        self._publish(change, "commit")

    def _committing(self, change: ProfileChange, members: Mapping[str, Member]) -> None:
        back = {
            name
            for name in change.restarts
            if name in members and members[name].pid != change.pids[name]
        }
        if self._is_waiting(change, tuple(change.restarts.keys() - back)):
            return
        if change.refusals:
            self._go_back(change, _listed(change.refusals))
            return
        restarted = change.settle({name: member.pid for name, member in members.items()})
        self._trial.begin()
        self._watch(change, restarted, again=[])

    def _watch(
        self, change: ProfileChange, restarted: Mapping[str, float], again: list[str]
    ) -> None:
        change.enter(ChangePhase.WATCH, self._clock.now_ns(), self._watch_ns)
        self._publish(change, "watch", restarted=restarted, again=again)

    def _watching(self, change: ProfileChange, _: Mapping[str, Member]) -> None:
        if self._clock.now_ns() >= change.deadline_ns:
            limit_ns = _ns(profile_change.VALIDATE_S)
            change.enter(ChangePhase.VALIDATE, self._clock.now_ns(), limit_ns)
            self._publish(change, "validate")

    def _validating(self, change: ProfileChange, _: Mapping[str, Member]) -> None:
        if self._is_waiting(change):
            return
        faults = [*self._trial.faults(change.target)]
        slow = change.refusals
        if slow and not (faults or change.was_slow or CONTROL in slow):
            change.was_slow = True
            self._watch(change, {}, again=[*slow])
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
        self._allegiance.adopt(change.pids)
        self._end(change, ChangeOutcome.KEPT, "")

    def _rolling_back(self, change: ProfileChange, _: Mapping[str, Member]) -> None:
        power_due = self._power_set is not None and not self._power_set.done()
        late = self._clock.now_ns() >= change.deadline_ns
        if (change.silent or power_due) and not late:
            return
        reason = change.failure
        if change.silent:
            reason += f"; {', '.join(change.silent)} did not go back and is started again"
            self._allegiance.doubt({name: change.pids[name] for name in change.silent})
        if self._power_set is not None and self._power_set.done() and self._power_set.result():
            reason += f"; {self._power_set.result()}"
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
        change.enter(ChangePhase.ROLLBACK, self._clock.now_ns(), _ns(profile_change.ROLLBACK_S))
        self._publish(change, "rollback")

    def _put_in_force(self, name: str, profile: Profile) -> None:
        self.profile, self.in_force = name, profile
        if self._on_change is not None:
            self._on_change(profile)

    def _is_waiting(self, change: ProfileChange, restarting: tuple[str, ...] = ()) -> bool:
        """Return whether answers may still come; when it is too late for them, go back."""
        missing = (*change.silent, *restarting)
        if not missing:
            return False
        if self._clock.now_ns() >= change.deadline_ns:
            self._go_back(change, f"{', '.join(missing)}: no answer to {change.phase} in time")
        return True

    # --- processes that come and go -----------------------------------------------------------

    def _look_for_dead(self, change: ProfileChange, members: Mapping[str, Member]) -> None:
        ended_for_it = change.restarts.keys() if change.committed else frozenset()
        dead = [
            name
            for name, pid in change.pids.items()
            if name not in ended_for_it and (name not in members or members[name].pid != pid)
        ]
        if not dead:
            return
        for name in dead:
            del change.pids[name]
        if change.phase is not ChangePhase.ROLLBACK:
            self._go_back(change, f"{', '.join(dead)} ended meanwhile")

    def _to_restart(self, change: ProfileChange, members: Mapping[str, Member]) -> tuple[str, ...]:
        if change.phase is not ChangePhase.COMMIT:
            return ()
        return tuple(
            name
            for name in change.restarts
            if name in members and members[name].pid == change.pids[name]
        )

    # --- tell ---------------------------------------------------------------------------------

    def _publish(self, change: ProfileChange, phase: str, **more: object) -> None:
        profile = change.request.profile
        self._changes.publish(
            {"change_id": change.change_id, "phase": phase, "profile": profile, **more}
        )

    def _end(self, change: ProfileChange, outcome: ChangeOutcome, reason: str) -> None:
        self._change = None
        took_s = (self._clock.now_ns() - change.began_ns) / NS_PER_S
        self._report.conclude(change.request, outcome, reason, took_s)


def _refuse_small_computer(profile: Profile) -> None:
    has_mb, wants_mb = psutil.virtual_memory().total / _MB, profile.total.memory_mb
    if wants_mb > has_mb:
        text = f"expected at most the {has_mb:.0f} MB that this computer has, got {wants_mb:g}"
        raise ProfileError((f"budgets.total.memory_mb: {text}",))


def _ns(duration_s: float) -> int:
    return round(duration_s * NS_PER_S)


def _listed(refusals: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in refusals.items())


def _restart_note(change: ProfileChange) -> str:
    return f"with a restart of {', '.join(sorted(change.restarts))}" if change.restarts else ""
