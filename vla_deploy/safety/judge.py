"""Judge one tick: (state, inputs, limits) -> (state, verdict); nothing else is read or changed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto

from vla_deploy.safety.causes import RULES, Cause, CauseRule, Latch, Reaction
from vla_deploy.safety.findings import Finding
from vla_deploy.safety.inputs import SafetyInputs, SafetyLimits
from vla_deploy.safety.surroundings import Direction


class ResetOutcome(Enum):
    """Say what became of a reset request in this tick."""

    NOT_ASKED = auto()
    DONE = auto()
    REFUSED = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Say what must be done and why; `latched` stays until a person resets it.

    `speed_ratio` bounds the base to that share of its top speeds, `blocked` are the motions that it
    may not make; both are what every active cause leaves, not only the one that is named.
    """

    reaction: Reaction
    cause: Cause
    latched: bool = False
    subject: str = ""
    measured: float = math.nan
    limit: float = math.nan
    age_s: float = 0.0
    advice: str = ""
    speed_ratio: float = 1.0
    blocked: frozenset[Direction] = frozenset()
    reset: ResetOutcome = ResetOutcome.NOT_ASKED

    @property
    def text(self) -> str:
        """Say in one line who, what was measured, what was allowed, and what to try."""
        if self.cause is Cause.NONE:
            return ""
        numbers = "" if math.isnan(self.limit) else f": {self.measured:.4g}, limit {self.limit:.4g}"
        return f"{self.cause.value} ({self.subject}){numbers}; {self.advice}"


CLEAR = Verdict(reaction=Reaction.NONE, cause=Cause.NONE)
_NO_COUNTS = (0,) * len(RULES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lingering:
    """Carry a verdict that ends by itself, after `left` more clear ticks."""

    verdict: Verdict
    left: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SafetyState:
    """Carry what outlives a tick.

    `counts` are findings in a row per rule; `latched` verdicts are in the order in which they came.
    """

    counts: tuple[int, ...] = _NO_COUNTS
    latched: tuple[Verdict, ...] = ()
    lingering: tuple[Lingering, ...] = ()

    @property
    def estop_latched(self) -> bool:
        """Return whether an emergency stop waits for its reset."""
        return any(verdict.cause is Cause.ESTOP for verdict in self.latched)


_FRESH = SafetyState()
_Found = dict[Cause, Finding]


def evaluate(
    state: SafetyState, inputs: SafetyInputs, limits: SafetyLimits
) -> tuple[SafetyState, Verdict]:
    """Return the next state and the most restrictive verdict of all rules.

    A reset is refused while any latched cause is still found; it never arms anything.
    """
    findings = [rule.probe(inputs, limits) for rule in RULES]
    if state == _FRESH and not inputs.reset_requested and not any(findings):
        return state, CLEAR
    found = {
        rule.cause: finding
        for rule, finding in zip(RULES, findings, strict=True)
        if finding is not None
    }
    counts = _counted(state.counts, findings)
    active = _active(counts, findings, inputs.energised)
    latched, outcome = _reset(state.latched, found, inputs.reset_requested)
    latched += _newly_latched(latched, active)
    lingering = _lingering(state.lingering, active, found)
    in_force = (*latched, *active, *(one.verdict for one in lingering))
    after = SafetyState(counts=counts, latched=latched, lingering=lingering)
    return after, _merged(in_force, outcome)


def _counted(counts: tuple[int, ...], findings: Sequence[Finding | None]) -> tuple[int, ...]:
    return tuple(
        0 if finding is None else min(count + 1, rule.debounce_samples)
        for rule, finding, count in zip(RULES, findings, counts, strict=True)
    )


def _active(
    counts: tuple[int, ...], findings: Sequence[Finding | None], energised: bool
) -> tuple[Verdict, ...]:
    return tuple(
        _verdict(rule, finding, energised)
        for rule, finding, count in zip(RULES, findings, counts, strict=True)
        if finding is not None and count >= rule.debounce_samples
    )


def _reset(
    latched: tuple[Verdict, ...], found: _Found, requested: bool
) -> tuple[tuple[Verdict, ...], ResetOutcome]:
    if not requested:
        return latched, ResetOutcome.NOT_ASKED
    if any(verdict.cause in found for verdict in latched):
        return latched, ResetOutcome.REFUSED
    return (), ResetOutcome.DONE


def _verdict(rule: CauseRule, finding: Finding, energised: bool) -> Verdict:
    return Verdict(
        reaction=rule.reaction,
        cause=rule.cause,
        latched=rule.latch is Latch.ALWAYS or (rule.latch is Latch.ENERGISED and energised),
        subject=finding.subject,
        measured=finding.measured,
        limit=finding.limit,
        age_s=finding.age_s,
        advice=rule.advice,
        speed_ratio=finding.speed_ratio if rule.reaction < Reaction.BASE_RAMP else 0.0,
        blocked=finding.blocked,
    )


def _newly_latched(
    latched: tuple[Verdict, ...], active: tuple[Verdict, ...]
) -> tuple[Verdict, ...]:
    known = {verdict.cause for verdict in latched}
    return tuple(v for v in active if v.latched and v.cause not in known)


def _lingering(
    before: tuple[Lingering, ...], active: tuple[Verdict, ...], found: _Found
) -> tuple[Lingering, ...]:
    """Count each down in clear ticks in a row; a finding starts it anew."""
    begun = (Lingering(verdict=verdict, left=_RELEASE[verdict.cause]) for verdict in active)
    causes = {verdict.cause for verdict in active}
    waiting = (
        replace(
            one, left=_RELEASE[one.verdict.cause] if one.verdict.cause in found else one.left - 1
        )
        for one in before
        if one.verdict.cause not in causes
    )
    return tuple(one for one in (*begun, *waiting) if one.left > 0)


_RELEASE = {rule.cause: rule.release_samples for rule in RULES}


def _merged(verdicts: tuple[Verdict, ...], outcome: ResetOutcome) -> Verdict:
    """Pick the most restrictive, among equals the oldest, which is the root cause.

    What the others forbid the base stays forbidden.
    """
    worst = max(verdicts, key=lambda verdict: verdict.reaction, default=CLEAR)
    return replace(
        worst,
        speed_ratio=min((verdict.speed_ratio for verdict in verdicts), default=1.0),
        blocked=frozenset().union(*(verdict.blocked for verdict in verdicts)),
        reset=outcome,
    )
