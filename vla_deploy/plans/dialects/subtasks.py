"""Read a goal that is divided into subtasks, each with actions of its own."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.plans.dialects.findings import Findings, shown
from vla_deploy.plans.dialects.values import Json

SUBTASKS: Final = "subtasks"
_TAKEN: Final = frozenset({"name", "description", "actions", "dependencies", "success_criteria"})
_ORDERS: Final = ("depends_on", "dependencies", "after")
_LONGEST_NAME: Final = 40


def actions_of(subtasks: Sequence[Any], findings: Findings, *, goes_on: bool) -> list[Json]:
    """Return the actions of all subtasks, of each after those of what it depends on.

    A subtask that names no dependencies comes after the one before it; its actions come one after
    the other. With `goes_on` that is an order alone, whatever became of those before.
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
        order = _named(subtask, last) or _behind([*last.values()][-1:], goes_on=goes_on)
        told = {"description": subtask["description"]} if "description" in subtask else {}
        for at, action in enumerate(own, start=1):
            is_ordered = any(key in action for key in _ORDERS)
            given = {"id": f"{name}_{at}", **({} if is_ordered else order), **told, **action}
            actions.append(given)
            order = _behind([str(given["id"])], goes_on=goes_on)
        last[name] = str(actions[-1]["id"])
    return actions


def _behind(names: list[str], *, goes_on: bool) -> dict[str, list[str]]:
    return {"after" if goes_on else "depends_on": names}


def _named(subtask: Mapping[str, Any], last: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the last actions of the subtasks on which one says that it depends."""
    named = subtask.get("dependencies")
    if named is None:
        return {}
    listed = named if isinstance(named, list) else [named]
    return {"depends_on": [last.get(str(one), str(one)) for one in listed]}


def criteria_of(subtasks: Sequence[Any]) -> tuple[str, ...]:
    """Return by what one knows that the subtasks are done."""
    told = [one.get("success_criteria") for one in subtasks if isinstance(one, Mapping)]
    listed = [one if isinstance(one, list) else [one] for one in told if one]
    return tuple(str(one) for several in listed for one in several)
