"""Read a goal that is divided into subtasks, each with actions of its own."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.plans.dialects.findings import Findings, shown
from vla_deploy.plans.dialects.values import Json

SUBTASKS: Final = "subtasks"
_TAKEN: Final = frozenset({"name", "description", "actions", "dependencies", "success_criteria"})
_LONGEST_NAME: Final = 40


def actions_of(subtasks: Sequence[Any], findings: Findings) -> list[Json]:
    """Return the actions of all subtasks, of each after those of what it depends on.

    A subtask that names no dependencies comes after the one before it.
    """
    actions: list[Json] = []
    last: dict[str, str] = {}
    for number, subtask in enumerate(subtasks, start=1):
        own = subtask.get("actions") if isinstance(subtask, Mapping) else None
        if not isinstance(own, list) or not own or not all(isinstance(one, Mapping) for one in own):
            findings.fault("", f"subtask {number} must be an object with a list of actions; "
                           f"got {shown(subtask)}")  # fmt: skip
            continue
        name = str(subtask.get("name", f"s{number}"))[:_LONGEST_NAME]
        for key, value in subtask.items():
            if key not in _TAKEN and value not in (None, [], ""):
                findings.note("", f"{name}.{key}", value, "not used, its actions say what is done")
        needs = _needs_of(subtask, last)
        for at, action in enumerate(own, start=1):
            given = {"id": f"{name}_{at}", "depends_on": needs}
            told = {"description": subtask["description"]} if "description" in subtask else {}
            actions.append({**given, **told, **action})
            needs = [str(actions[-1]["id"])]
        last[name] = needs[0]
    return actions


def _needs_of(subtask: Mapping[str, Any], last: Mapping[str, str]) -> list[str]:
    """Return the last actions of the subtasks that come before one."""
    named = subtask.get("dependencies")
    if isinstance(named, list):
        return [last.get(str(one), str(one)) for one in named]
    return [*last.values()][-1:]


def criteria_of(subtasks: Sequence[Any]) -> tuple[str, ...]:
    """Return by what one knows that the subtasks are done."""
    told = [one.get("success_criteria") for one in subtasks if isinstance(one, Mapping)]
    return tuple(one for one in told if isinstance(one, str) and one)
