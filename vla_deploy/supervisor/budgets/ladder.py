"""Decide, without doing anything, which steps of the declared ladder are in force."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from platforms import LadderAction, LadderStep, LadderTiming
from vla_deploy.supervisor.budgets.judge import TOTAL, BudgetFinding, lasts

# A step that is needed again soon after it was undone stays twice as long, up to 2^5 times.
_MOST_RELAPSES = 5
_FORGIVEN_AFTER = 4.0
EMERGENCY = LadderStep(action=LadderAction.PROTECTIVE_STOP)


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """Hold one step in force: which, since when, and why."""

    step: LadderStep
    since_ns: int
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LadderMove:
    """Hold that a step was taken or undone."""

    step: LadderStep
    taken: bool
    why: str
    at_ns: int

    def __str__(self) -> str:
        whose = f" of {self.step.process}" if self.step.process else ""
        return f"{'took' if self.taken else 'undid'} {self.step.action}{whose}: {self.why}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LadderState:
    """Hold the steps in force, in the order they were taken, and when anything changed."""

    taken: tuple[Taken, ...] = ()
    changed_ns: int | None = None
    undone_ns: int | None = None
    relapses: int = 0
    alarm_ns: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pressure:
    """Hold what the ladder responds to; `emergency` is the reason, or ""."""

    findings: tuple[BudgetFinding, ...]
    emergency: str = ""


def climb(
    ladder: Sequence[LadderStep],
    timing: LadderTiming,
    before: LadderState,
    pressure: Pressure,
    now_ns: int,
) -> tuple[LadderState, LadderMove | None]:
    """Return the new state and the one change there is, if any.

    A step is taken when an excess has lasted for the rise time since the change before it; one is
    undone when nothing that concerns it has been over for the fall time. Those of the process that
    breaks its own budget come first, the others answer only what concerns the whole robot. An
    emergency skips all of it.
    """
    state = _forgiven(before, timing, now_ns)
    if pressure.emergency:
        return _alarmed(state, pressure.emergency, now_ns)
    pressing = [one for one in pressure.findings if _presses(one, state, timing, now_ns)]
    step = _next_step(ladder, state, pressing)
    if step is not None:
        return _take(state, step, _why(pressing, step), timing, now_ns)
    return _relieve(state, timing, [one for one in pressure.findings if one.over], now_ns)


def _presses(finding: BudgetFinding, state: LadderState, timing: LadderTiming, now_ns: int) -> bool:
    if not finding.over or not lasts(finding.beyond_since_ns, timing.rise_s, now_ns):
        return False
    return state.changed_ns is None or lasts(state.changed_ns, timing.rise_s, now_ns)


def _next_step(
    ladder: Sequence[LadderStep], state: LadderState, pressing: Sequence[BudgetFinding]
) -> LadderStep | None:
    offenders = {one.line.process for one in pressing} - {TOTAL}
    free = _free(ladder, state)
    own = [step for step in free if step.process in offenders]
    if own:
        return own[0]
    if not any(one.line.process == TOTAL for one in pressing):
        return None
    # Restarting a process that keeps its budget helps nothing.
    return next((step for step in free if step.action is not LadderAction.RESTART), None)


def _free(ladder: Sequence[LadderStep], state: LadderState) -> list[LadderStep]:
    """Return the steps not in force; a ladder may declare the same one twice, one tier each."""
    in_force = [one.step for one in state.taken]
    free = []
    for step in ladder:
        if step in in_force:
            in_force.remove(step)
        else:
            free.append(step)
    return free


def _why(pressing: Iterable[BudgetFinding], step: LadderStep) -> str:
    concerned = [one for one in pressing if one.line.process in (TOTAL, step.process)]
    return "; ".join(str(one) for one in concerned)


def _take(
    state: LadderState, step: LadderStep, why: str, timing: LadderTiming, now_ns: int
) -> tuple[LadderState, LadderMove]:
    relapsed = state.undone_ns is not None and not lasts(
        state.undone_ns, _FORGIVEN_AFTER * _patience_s(state, timing), now_ns
    )
    after = replace(
        state,
        taken=(*state.taken, Taken(step=step, since_ns=now_ns, why=why)),
        changed_ns=now_ns,
        undone_ns=None,
        relapses=min(state.relapses + relapsed, _MOST_RELAPSES),
    )
    return after, LadderMove(step=step, taken=True, why=why, at_ns=now_ns)


def _alarmed(state: LadderState, why: str, now_ns: int) -> tuple[LadderState, LadderMove | None]:
    alarmed = replace(state, alarm_ns=now_ns)
    if any(one.step == EMERGENCY for one in state.taken):
        return alarmed, None
    after = replace(
        alarmed,
        taken=(*state.taken, Taken(step=EMERGENCY, since_ns=now_ns, why=why)),
        changed_ns=now_ns,
    )
    return after, LadderMove(step=EMERGENCY, taken=True, why=why, at_ns=now_ns)


def _relieve(
    state: LadderState, timing: LadderTiming, over: Sequence[BudgetFinding], now_ns: int
) -> tuple[LadderState, LadderMove | None]:
    patience_s = _patience_s(state, timing)
    quiet = (state.changed_ns, state.alarm_ns)
    if any(at is not None and not lasts(at, patience_s, now_ns) for at in quiet):
        return state, None
    spare = next((one for one in reversed(state.taken) if not _needed(one.step, over)), None)
    if spare is None:
        return state, None
    why = f"relieved after {patience_s:g} s"
    after = replace(
        state,
        taken=tuple(one for one in state.taken if one is not spare),
        changed_ns=now_ns,
        undone_ns=now_ns,
        alarm_ns=None,
    )
    return after, LadderMove(step=spare.step, taken=False, why=why, at_ns=now_ns)


def _needed(step: LadderStep, over: Iterable[BudgetFinding]) -> bool:
    return any(one.line.process in (TOTAL, step.process) for one in over)


def _patience_s(state: LadderState, timing: LadderTiming) -> float:
    return timing.fall_s * float(2**state.relapses)


def _forgiven(state: LadderState, timing: LadderTiming, now_ns: int) -> LadderState:
    """Forget relapses once nothing has been needed for long."""
    if state.taken or not state.relapses:
        return state
    calm = lasts(state.undone_ns, _FORGIVEN_AFTER * _patience_s(state, timing), now_ns)
    return replace(state, relapses=0) if calm else state
