"""Choose among several plans for one command: by vote on what they do, then by how feasible."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vla_deploy.planning.meaning import meaning_of
from vla_deploy.planning.plan import Plan


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """Hold a plan that may run, and how sure its model is of it, 0 to 1.

    `plan` is as it was proposed, `checked` as it would run.
    """

    plan: Plan
    checked: Plan
    confidence: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Hold the candidate chosen, how many of how many agreed with it, and how sure that makes."""

    candidate: Candidate
    votes: int
    asked: int

    @property
    def confidence(self) -> float:
        """Return how sure the vote makes it; of a single plan, how sure its model is.

        The rule of succession: three of three give 0.8, two of three 0.6.
        """
        if self.asked == 1:
            return self.candidate.confidence
        return (self.votes + 1) / (self.asked + 2)


def chosen(candidates: Sequence[Candidate], asked: int, places: Mapping[str, str]) -> Choice:
    """Return the plan that most candidates share; between equals the more feasible one.

    `asked` is how many plans were asked for: one that could not run votes for nothing.
    """
    meanings = [meaning_of(one.checked, places) for one in candidates]
    votes = {meaning: meanings.count(meaning) for meaning in meanings}
    best = max(range(len(candidates)), key=lambda n: (votes[meanings[n]], *_ease(candidates[n])))
    return Choice(candidate=candidates[best], votes=votes[meanings[best]], asked=asked)


def _ease(candidate: Candidate) -> tuple[float, float, int]:
    """Return how feasible a plan is: its weakest action, how sure its model is, how short it is."""
    actions = candidate.checked.actions
    weakest = min((one.feasibility_score for one in actions), default=0.0)
    return (weakest, candidate.confidence, -len(actions))
