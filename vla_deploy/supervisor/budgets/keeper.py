"""Keep the budgets of one run: judge what was measured, take and undo steps, publish them."""

import logging
import os
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import LadderAction, Profile
from platforms.probes import ProbeSet, open_probes
from vla_deploy.ipc import ClaimBook, SharedSpace, topics
from vla_deploy.supervisor.budgets.cgroup import CgroupTree
from vla_deploy.supervisor.budgets.documents import (
    board,
    directives,
    enforcement_rows,
    history_rows,
    ladder_rows,
    rows,
    stop_reason,
)
from vla_deploy.supervisor.budgets.emergency import Emergencies, critical_trips_c
from vla_deploy.supervisor.budgets.enforcement import Enforcer
from vla_deploy.supervisor.budgets.judge import (
    BudgetFinding,
    Findings,
    Line,
    Measurement,
    judge,
    lines_of,
)
from vla_deploy.supervisor.budgets.ladder import EMERGENCY, LadderMove, LadderState, Pressure, climb
from vla_deploy.supervisor.budgets.sampler import (
    OUTSIDE_THE_TOTAL,
    BackgroundSampler,
    Measurements,
    Measurer,
    UsageSnapshot,
)

PUBLISH_PERIOD_NS: Final = NS_PER_S // 2
STALE_AFTER_NS: Final = 5 * NS_PER_S
KEPT_CHANGES: Final = 20
_REASON_CHARACTERS: Final = 500
LOADING_MODELS: Final = ("perception", "speech", "planner")
WARNED_ONLY: Final = frozenset({"disk_free_mb"})
"""What no step of the ladder relieves."""
_SUPERVISOR: Final = "supervisor"
_log = logging.getLogger(__name__)


class BudgetKeeper:
    """Hold the run to its profile's budgets.

    `step` runs in the supervisor's loop: it measures nothing itself and never waits.
    """

    def __init__(
        self,
        profile: Callable[[], Profile],
        space: SharedSpace,
        clock: Clock,
        feed: BackgroundSampler,
        emergencies: Emergencies,
        enforcer: Enforcer,
        claims: ClaimBook,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self._profile_now = profile
        self._claims = claims
        self._clock = clock
        self._feed = feed
        self._emergencies = emergencies
        self._enforcer = enforcer
        self._measurer = Measurer()
        self._directives = space.cell_writer(topics.RESOURCE_DIRECTIVES)
        self._cell = space.cell_writer(topics.BUDGET)
        self._board = space.cell_writer(topics.BOARD)
        self._stop_cell = space.cell_writer(topics.BUDGET_STOP)
        self._findings: dict[tuple[str, str], BudgetFinding] = {}
        self._ladder = LadderState()
        self._changes: deque[LadderMove] = deque(maxlen=KEPT_CHANGES)
        self._emergency = ""
        self._seen_ns = clock.now_ns()
        self._stale = False
        self._published_ns = 0
        self._profile = profile()
        self._take_over(self._profile)

    def adopt(self, profile: Profile) -> None:
        """Take over the budgets of another profile; steps that it does not declare are undone."""
        if profile is self._profile:
            return
        known, now_ns = (*profile.ladder, EMERGENCY), self._clock.now_ns()
        for one in reversed(self._ladder.taken):
            if one.step not in known:
                why = f"profile {profile.name} does not declare it"
                self._record(LadderMove(step=one.step, taken=False, why=why, at_ns=now_ns))
        self._take_over(profile)

    def _take_over(self, profile: Profile) -> None:
        self._profile = profile
        self._lines: tuple[Line, ...] = lines_of(profile.budgets, profile.total)
        known = (*profile.ladder, EMERGENCY)
        kept = tuple(one for one in self._ladder.taken if one.step in known)
        self._ladder = replace(self._ladder, taken=kept)
        self._enforcer.adopt(profile.budgets)
        self._claims.declare(_memory_of(profile))

    @property
    def snapshot(self) -> UsageSnapshot | None:
        """Return what was measured last, or None before the first time."""
        return self._feed.latest()

    @property
    def suspended(self) -> frozenset[str]:
        """Return the processes that must not run."""
        return frozenset(directives(self._ladder.taken)["suspended"])

    @property
    def rate_ratios(self) -> Mapping[str, float]:
        """Return the share of its rate at which a process must work; one not named, at all."""
        ratios: Mapping[str, float] = directives(self._ladder.taken)["rate_ratio"]
        return ratios

    def step(self, pids: Mapping[str, int]) -> dict[str, str]:
        """Judge new measurements; return the processes to start again, each with the reason."""
        now_ns = self._clock.now_ns()
        self.adopt(self._profile_now())
        everyone = {_SUPERVISOR: os.getpid(), **pids}
        self._feed.watch(everyone)
        restart: dict[str, str] = {}
        if self._feed.failures:
            self.counts["measuring_failed"] = self._feed.failures
        fresh = self._feed.since(self._seen_ns)
        if fresh:
            self._seen_ns, self._stale = fresh[-1].stamp_ns, False
            restart = self._judge(self._measure(fresh), now_ns)
            self._enforcer.enforce(everyone, self._findings.values())
        elif now_ns - self._seen_ns > STALE_AFTER_NS and not self._stale:
            self._stale = True
            self._judge(self._unknown(), now_ns)
        if restart or now_ns - self._published_ns >= PUBLISH_PERIOD_NS:
            self._publish(now_ns)
        return restart

    def close(self) -> None:
        """End the measuring, and remove what enforcement has made."""
        self._feed.close()
        self._enforcer.close()

    def _measure(self, fresh: Sequence[UsageSnapshot]) -> Measurements:
        """Return the newest numbers; an emergency in any of the fresh snapshots counts."""
        reasons = [self._emergencies.judge(one.readings) for one in fresh]
        self._emergency = next(filter(None, reversed(reasons)), "")
        for snapshot in fresh:
            measured = self._measurer.measure(snapshot, frozenset(self._profile.budgets))
        return measured

    def _unknown(self) -> Measurements:
        reason = (
            f"nothing was measured for {STALE_AFTER_NS / NS_PER_S:g} s: a sensor hangs, or failed"
        )
        _log.warning("budgets: %s", reason)
        return {line.key: Measurement(value=None, reason=reason) for line in self._lines}

    def _judge(self, measured: Measurements, now_ns: int) -> dict[str, str]:
        timing, before = self._profile.ladder_timing, self._findings
        self._findings = judge(self._lines, before, measured, timing, now_ns)
        _log_excesses(before, self._findings)
        relievable = tuple(
            one for one in self._findings.values() if one.line.metric not in WARNED_ONLY
        )
        pressure = Pressure(findings=relievable, emergency=self._emergency)
        self._ladder, change = climb(self._profile.ladder, timing, self._ladder, pressure, now_ns)
        if change is None:
            return {}
        self._record(change)
        self._publish(now_ns)
        restarts = change.taken and change.step.action is LadderAction.RESTART
        return {change.step.process: f"over budget: {change.why}"} if restarts else {}

    def _record(self, change: LadderMove) -> None:
        self._changes.append(change)
        self.counts["taken" if change.taken else "undone"] += 1
        self.counts[change.step.action.value] += change.taken
        _log.log(logging.WARNING if change.taken else logging.INFO, "budgets: %s", change)

    def _publish(self, now_ns: int) -> None:
        self._published_ns = now_ns
        snapshot = self._feed.latest()
        if snapshot is not None and not self._stale:  # old readings are left to grow stale
            self._board.put_document(board(snapshot.readings.values()))
        taken = self._ladder.taken
        stop = stop_reason(taken)
        self._stop_cell.put_document({"stop": bool(stop), "reason": stop[:_REASON_CHARACTERS]})
        self._directives.put_document(directives(taken))
        self._cell.put_document(
            {
                "rows": rows(self._findings.values(), now_ns),
                "ladder": {
                    "step": len(taken),
                    "taken": ladder_rows(taken, now_ns),
                    "history": history_rows(self._changes, now_ns),
                    "counts": dict(self.counts),
                },
                "enforced": enforcement_rows(self._enforcer.enforced),
                "hint": self._emergencies.hint,
                "stop": bool(stop),
                "reason": stop,
            }
        )


def _memory_of(profile: Profile) -> dict[str, int]:
    """Return the memory that models may claim: what the others' budgets leave of the total."""
    others_mb = sum(
        budget.memory_mb
        for name, budget in profile.budgets.items()
        if name not in (*LOADING_MODELS, *OUTSIDE_THE_TOTAL)
    )
    gpu_mb = profile.total.gpu_memory_mb
    memory = {"ram_mb": int(profile.total.memory_mb - others_mb)}
    return memory if gpu_mb is None else {**memory, "gpu_memory_mb": int(gpu_mb)}


def _log_excesses(before: Findings, after: Findings) -> None:
    for key, finding in after.items():
        was_over = key in before and before[key].over
        if finding.over and not was_over:
            _log.warning("budgets: %s", finding)
        elif was_over and not finding.over:
            _log.info("budgets: %s keeps its budget again", " ".join(filter(None, reversed(key))))


def open_keeper(
    profile: Callable[[], Profile],
    space: SharedSpace,
    clock: Clock,
    state_dir: Path,
    probe_root: Path,
) -> BudgetKeeper:
    """Begin to measure, and return the keeper of a run's budgets.

    The disk is the one of `state_dir`, which holds logs, crash reports and recordings.
    """

    def probes() -> ProbeSet:
        return open_probes(probe_root, disk_folders=[_existing(state_dir)])

    return BudgetKeeper(
        profile,
        space,
        clock,
        BackgroundSampler(probes, clock, MonotonicClock()),
        Emergencies(partial(critical_trips_c, probe_root)),
        Enforcer(CgroupTree(realtime=profile().realtime_priority > 0)),
        ClaimBook(space, clock),
    )


def _existing(folder: Path) -> Path:
    return next(one for one in (folder, *folder.parents) if one.exists())
