"""Choose among several plans for one command: by vote on what they move, then by feasibility."""

from collections.abc import Sequence
from dataclasses import dataclass

from vla_deploy.planning.comparison import move_the_same
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCandidate:
    """Hold a plan that may run, and how sure its model is of it, 0 to 1.

    `plan` is as it was proposed, `checked` as it would run.
    """

    plan: Plan
    checked: Plan
    confidence: float


def elected(
    candidates: Sequence[PlanCandidate], asked: int, request: Request
) -> tuple[PlanCandidate, float]:
    """Return the plan that most candidates share, and how sure the vote makes it.

    Between equals the more feasible one is taken. `asked` is how many plans were asked for: one
    that could not run votes for nothing. A single plan is as sure as its model is; else the rule of
    succession holds: three of three give 0.8, two of three 0.6.
    """
    votes = [
        sum(move_the_same(one.checked, other.checked, request) for other in candidates)
        for one in candidates
    ]
    best = max(range(len(candidates)), key=lambda n: (votes[n], *_ease(candidates[n])))
    confidence = candidates[best].confidence if asked == 1 else (votes[best] + 1) / (asked + 2)
    return candidates[best], confidence


def _ease(candidate: PlanCandidate) -> tuple[float, float, int]:
    """Return how feasible a plan is: its weakest action, how sure its model is, how short it is."""
    actions = candidate.checked.actions
    weakest = min((one.feasibility_score for one in actions), default=0.0)
    return (weakest, candidate.confidence, -len(actions))
