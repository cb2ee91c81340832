"""Choose among several plans for one command: by vote on what they do, then by how feasible."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.planning.catalogue import SKILLS, Type
from vla_deploy.planning.errors import PlanningError
from vla_deploy.planning.plan import Action, Plan, execution_order
from vla_deploy.planning.references import match_place, parse_object

_DIGITS: Final = 2
Meaning = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCandidate:
    """Hold a plan that may run, and how sure its model is of it, 0 to 1.

    `plan` is as it was proposed, `checked` as it would run.
    """

    plan: Plan
    checked: Plan
    confidence: float


def elected(
    candidates: Sequence[PlanCandidate], asked: int, places: Mapping[str, str]
) -> tuple[PlanCandidate, float]:
    """Return the plan that most candidates share, and how sure the vote makes it.

    Between equals the more feasible one is taken. `asked` is how many plans were asked for: one
    that could not run votes for nothing. A single plan is as sure as its model is; else the rule of
    succession holds: three of three give 0.8, two of three 0.6.
    """
    meanings = [meaning_of(one.checked, places) for one in candidates]
    votes = [meanings.count(meaning) for meaning in meanings]
    best = max(range(len(candidates)), key=lambda n: (votes[n], *_ease(candidates[n])))
    confidence = candidates[best].confidence if asked == 1 else (votes[best] + 1) / (asked + 2)
    return candidates[best], confidence


def meaning_of(plan: Plan, places: Mapping[str, str]) -> Meaning:
    """Return what a plan does, stage by stage; plans of equal meaning do the same.

    A stage holds the actions that may run once those of the stages before it are done. `places`
    maps every spoken name to a place. What is said aloud may be worded in any way.
    """
    stage_of: dict[str, int] = {}
    stages: dict[int, list[str]] = {}
    for action in execution_order(plan.actions):
        stage = max((stage_of[needed] + 1 for needed in action.depends_on), default=0)
        stage_of[action.id] = stage
        stages.setdefault(stage, []).append(_meaning(action, places))
    return tuple(tuple(sorted(stages[stage])) for stage in sorted(stages))


def _meaning(action: Action, places: Mapping[str, str]) -> str:
    parameters = SKILLS[action.skill].parameters
    given = [
        f"{name}={_value(value, parameters[name].type, places)}"
        for name, value in sorted(action.parameters.items())
        if value is not None
    ]
    return " ".join([action.skill, *given])


def _value(value: Any, kind: Type, places: Mapping[str, str]) -> str:
    match kind:
        case Type.NUMBER:
            return f"{float(value):.{_DIGITS}f}"
        case Type.TEXT:
            return "*"
        case Type.CHOICE:
            return str(value)
        case _:
            return match_place(str(value), places) or _object(str(value))


def _object(words: str) -> str:
    try:
        return str(parse_object(words))
    except PlanningError:
        return words


def _ease(candidate: PlanCandidate) -> tuple[float, float, int]:
    """Return how feasible a plan is: its weakest action, how sure its model is, how short it is."""
    actions = candidate.checked.actions
    weakest = min((one.feasibility_score for one in actions), default=0.0)
    return (weakest, candidate.confidence, -len(actions))
