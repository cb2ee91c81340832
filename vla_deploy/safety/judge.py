"""Judge one tick: (state, inputs, limits) -> (state, verdict); nothing else is read or changed."""

import math
from dataclasses import dataclass, replace
from enum import Enum

from vla_deploy.safety.causes import RULES, Cause, Latch, Reaction, Rule
from vla_deploy.safety.inputs import SafetyInputs, SafetyLimits
from vla_deploy.safety.probes import Finding


class ResetOutcome(Enum):
    """Say what became of a reset request in this tick."""

    NOT_ASKED = "not asked"
    DONE = "done"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Say what must be done and why; `latched` stays until a person resets it."""

    reaction: Reaction
    cause: Cause
    latched: bool = False
    subject: str = ""
    measured: float = math.nan
    limit: float = math.nan
    age_s: float = 0.0
    advice: str = ""
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
class SafetyState:
    """Carry what outlives a tick: findings in a row per rule, and the latched verdicts in order."""

    counts: tuple[int, ...] = _NO_COUNTS
    latched: tuple[Verdict, ...] = ()

    @property
    def estop_latched(self) -> bool:
        """Tell whether an emergency stop waits for its reset."""
        return any(verdict.cause is Cause.ESTOP for verdict in self.latched)


def evaluate(
    state: SafetyState, inputs: SafetyInputs, limits: SafetyLimits
) -> tuple[SafetyState, Verdict]:
    """Return the next state and the most restrictive verdict of all rules.

    A reset is refused while any latched cause is still found; it never arms anything.
    """
    findings = [rule.probe(inputs, limits) for rule in RULES]
    if state == _FRESH and not any(findings) and not inputs.reset_requested:
        return state, CLEAR
    latched, outcome = _reset(state.latched, findings, inputs.reset_requested)
    counts = tuple(
        0 if finding is None else min(count + 1, rule.debounce_samples)
        for rule, finding, count in zip(RULES, findings, state.counts, strict=True)
    )
    active = [
        _verdict(rule, finding, inputs.energised)
        for rule, finding, count in zip(RULES, findings, counts, strict=True)
        if finding is not None and count >= rule.debounce_samples
    ]
    latched = latched + _newly_latched(latched, active)
    return SafetyState(counts=counts, latched=latched), _worst((*latched, *active), outcome)


_FRESH = SafetyState()


def _reset(
    latched: tuple[Verdict, ...], findings: list[Finding | None], requested: bool
) -> tuple[tuple[Verdict, ...], ResetOutcome]:
    if not requested:
        return latched, ResetOutcome.NOT_ASKED
    present = {
        rule.cause for rule, finding in zip(RULES, findings, strict=True) if finding is not None
    }
    if any(verdict.cause in present for verdict in latched):
        return latched, ResetOutcome.REFUSED
    return (), ResetOutcome.DONE


def _verdict(rule: Rule, finding: Finding, energised: bool) -> Verdict:
    return Verdict(
        reaction=rule.reaction,
        cause=rule.cause,
        latched=rule.latch is Latch.ALWAYS or (rule.latch is Latch.ENERGISED and energised),
        subject=finding.subject,
        measured=finding.measured,
        limit=finding.limit,
        age_s=finding.age_s,
        advice=rule.advice,
    )


def _newly_latched(latched: tuple[Verdict, ...], active: list[Verdict]) -> tuple[Verdict, ...]:
    known = {verdict.cause for verdict in latched}
    return tuple(v for v in active if v.latched and v.cause not in known)


def _worst(verdicts: tuple[Verdict, ...], outcome: ResetOutcome) -> Verdict:
    """Pick the most restrictive; among equals the oldest, which is the root cause."""
    return replace(max(verdicts, key=lambda v: v.reaction, default=CLEAR), reset=outcome)
