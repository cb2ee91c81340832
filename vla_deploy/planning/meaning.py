"""Compare plans by what they do, whatever their words, ids and the order of what is independent."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.planning.catalogue import SKILLS, Type
from vla_deploy.planning.errors import PlanningError
from vla_deploy.planning.plan import Action, Plan, execution_order
from vla_deploy.planning.references import match_place, parse_object

_DIGITS: Final = 2
Meaning = tuple[tuple[str, ...], ...]


def meaning_of(plan: Plan, places: Mapping[str, str]) -> Meaning:
    """Return what a plan does, stage by stage; plans of equal meaning do the same.

    A stage holds the actions that may run once those of the stages before it are done. `places`
    maps every spoken name to a place. What is said aloud may be worded in any way.

    Raises:
        ValueError: the dependencies are no order.
    """
    stage_of: dict[str, int] = {}
    stages: dict[int, list[str]] = {}
    for action in execution_order(plan.actions):
        stage = max((stage_of[needed] + 1 for needed in action.depends_on), default=0)
        stage_of[action.id] = stage
        stages.setdefault(stage, []).append(_meaning(action, places))
    return tuple(tuple(sorted(stages[stage])) for stage in sorted(stages))


def _meaning(action: Action, places: Mapping[str, str]) -> str:
    spec = SKILLS.get(action.skill)
    given = [
        f"{name}={_value(value, spec.parameters[name].type, places)}"
        for name, value in sorted(action.parameters.items())
        if spec is not None and name in spec.parameters and value is not None
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
