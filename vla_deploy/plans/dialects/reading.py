"""Turn the plans of language models and older tools into the canonical plan.

canonical  id, skill, parameters, depends_on
typed      id, type, action, parameters, dependencies
ranked     action_type, parameters, priority
terse      action, params, description

All keys are known in all of them. Nothing is dropped without a note, and what cannot be meant is a
fault that names the action, the key, what came and what to write.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pydantic import ValidationError

from vla_deploy.plans.dialects.actions import ActionReading, read_action
from vla_deploy.plans.dialects.document import LISTS, plan_document
from vla_deploy.plans.dialects.findings import Findings, PlanNote, shown
from vla_deploy.plans.dialects.subtasks import SUBTASKS, actions_of, criteria_of
from vla_deploy.plans.dialects.values import Json
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.plan import MOST_ACTIONS, ExecutionOptions, Plan

GOALS: Final = ("goal", "task", "command", "objective", "original_command")
OPTIONS: Final = ("options", "execution_options")
_TEXTS: Final = ("summary", "reasoning")
_LISTS_OF_TEXTS: Final = ("safety_concerns", "success_criteria")
_FEASIBLE: Final = ("feasible", "can_recover")
NOT_USED: Final[Mapping[str, str]] = {
    "robot_capabilities": "not used, the robot file says what this robot can do",
    "environment_context": "not used, the robot goes by what it sees; to check in it: --scene",
    "expected_duration": "not used, it is the sum over the actions",
    "keeps_out": "not used, the planner fills it in",
    "notes": "not used, they are written anew",
}
"""What documents say of a plan beside its actions, and why it changes nothing."""
_NOT_USED: Final = "not used"
_LONGEST_STEM: Final = 40
_MOST_NOTE_CHARACTERS: Final = 3_000


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanReading:
    """Hold a plan as it was read, and what became of what its author wrote otherwise."""

    plan: Plan
    notes: tuple[PlanNote, ...] = ()

    def notes_of(self, action_id: str) -> tuple[PlanNote, ...]:
        """Return the notes of one action; those of the plan itself for ""."""
        return tuple(one for one in self.notes if one.action_id == action_id)


def parse_plan(document: str | Json | list[Any]) -> Plan:
    """Return the plan that `read_plan` finds; its notes stand in the plan, too.

    Raises:
        PlanInvalid: it is no plan; every fault is named.
    """
    return read_plan(document).plan


def read_plan(document: str | Json | list[Any]) -> PlanReading:
    """Read a plan in any dialect, also when a model wrapped its JSON in prose.

    Raises:
        PlanInvalid: no JSON in the text, or what it holds is no plan; every fault is named.
    """
    found, findings = plan_document(document), Findings()
    fields = _plan_fields(found, findings)
    options = _options(found, findings)
    actions = _actions(found, findings, goes_on=options.continue_on_error)
    if findings.faults:
        raise PlanInvalid(findings.faults)
    notes = tuple(findings.notes)
    fields |= {"options": options, "actions": actions, "notes": _first(notes)}
    try:
        plan = Plan.model_validate(fields)
    except ValidationError as error:
        raise PlanInvalid(_faults_of(error)) from error
    return PlanReading(plan=plan, notes=notes)


def _first(notes: Sequence[PlanNote]) -> tuple[str, ...]:
    """Return as many notes as a plan carries: the messages that it goes by are bounded."""
    first, left = list[str](), _MOST_NOTE_CHARACTERS
    for one in map(str, notes):
        left -= len(one)
        if left < 0:
            return (*first, f"and {len(notes) - len(first)} more; see: vla-deploy check --plan")
        first.append(one)
    return tuple(first)


def _faults_of(error: ValidationError, above: str = "") -> list[str]:
    return [
        f"{'.'.join(map(str, (*([above] if above else ()), *fault['loc']))) or 'plan'}: "
        f"{fault['msg']}; got {shown(fault['input'])}"
        for fault in error.errors()
    ]


# --- the plan's own keys ------------------------------------------------------------------------


def _plan_fields(document: Json, findings: Findings) -> Json:
    fields: Json = {"goal": "unnamed goal"}
    used = {_list_key(document), _options_key(document)}
    for key in GOALS:
        value = document.get(key)
        value = value.get("original_command") if isinstance(value, Mapping) else value
        if isinstance(value, str) and value.strip() and not used.intersection(GOALS):
            fields["goal"] = value
            used.add(key)
    for key in (*_TEXTS, *_FEASIBLE):
        name = "feasible" if key in _FEASIBLE else key
        if document.get(key) is not None and name not in fields:
            fields[name] = document[key]
            used.add(key)
    if _list_key(document) == SUBTASKS:
        fields["success_criteria"] = criteria_of(document[SUBTASKS])
    for key in _LISTS_OF_TEXTS:
        value = document.get(key)
        if value is not None:
            fields[key] = ((value,) if value.strip() else ()) if isinstance(value, str) else value
            used.add(key)
    for key, value in document.items():
        if key not in used and value not in (None, [], {}, ""):
            findings.note("", key, value, NOT_USED.get(key, _NOT_USED))
    return fields


def _list_key(document: Json) -> str:
    """Return under which key the actions stand, the first that holds any; "" where none does."""
    listed = [key for key in (*LISTS, SUBTASKS) if isinstance(document.get(key), list)]
    return next((key for key in listed if document[key]), listed[0] if listed else "")


def _options_key(document: Json) -> str:
    return next((key for key in OPTIONS if document.get(key) is not None), "")


def _options(document: Json, findings: Findings) -> ExecutionOptions:
    key = _options_key(document)
    given = document.get(key, {})
    if not isinstance(given, Mapping):
        findings.fault("", f'{key} must be an object such as {{"continue_on_error": true}}; '
                       f"got {shown(given)}")  # fmt: skip
        return ExecutionOptions()
    if given.get("safety_check", True) is False:
        findings.fault("", f"{key}.safety_check must be true: the checks of a plan are never "
                       "switched off; got false, leave it out")  # fmt: skip
        given = {**given, "safety_check": True}
    try:
        return ExecutionOptions.model_validate(given)
    except ValidationError as error:
        findings.faults += _faults_of(error, key)
        return ExecutionOptions()


# --- its actions --------------------------------------------------------------------------------


def _actions(document: Json, findings: Findings, *, goes_on: bool) -> list[Json]:
    """Return the canonical actions, those that are not ordered by their author one by one."""
    key = _list_key(document)
    listed = document.get(key, [])
    if key == SUBTASKS:
        listed = actions_of(listed, findings, goes_on=goes_on)
    if len(listed) > MOST_ACTIONS:
        findings.fault("", f"the plan has {len(listed)} actions, {MOST_ACTIONS} at most")
        return []
    read = [read_action(one, number, findings) for number, one in enumerate(listed, start=1)]
    return _ordered([one for one in read if one is not None], goes_on=goes_on)


def _ordered(read: Sequence[ActionReading], *, goes_on: bool) -> list[Json]:
    """Return actions with what comes before each.

    Where the author has named no dependencies and gives each a priority, they come in that order.
    An action without dependencies comes after the one before it, whatever became of that with
    `goes_on`; not where that one waits for it.
    """
    is_ranked = all("priority" in one.fields and not one.is_ordered for one in read)
    ranked = sorted(read, key=lambda one: one.fields["priority"]) if is_ranked else read
    earlier = {one.action_id: {*(one.needs or ()), *(one.after or ())} for one in read}
    taken, actions = {one.action_id for one in read}, list[Json]()
    previous = ""
    for one in ranked:
        needs, after = one.needs or (), one.after or ()
        if previous and not one.is_ordered and not _waits(previous, one.action_id, earlier):
            earlier[one.action_id].add(previous)
            needs, after = ((), (previous,)) if goes_on else ((previous,), ())
        actions += _steps_of(one, needs, after, taken)
        previous = one.action_id
    return actions


def _waits(action_id: str, other: str, earlier: Mapping[str, set[str]]) -> bool:
    """Return whether an action comes after another one, of which it may be several steps away."""
    seen, left = set[str](), [action_id]
    while left:
        at = left.pop()
        if at == other:
            return True
        if at not in seen:
            seen.add(at)
            left += earlier.get(at, ())
    return False


def _steps_of(
    one: ActionReading, needs: tuple[str, ...], after: tuple[str, ...], taken: set[str]
) -> list[Json]:
    """Return an action as one or several canonical ones, each after the one before it."""
    steps: list[Json] = []
    for skill, parameters in one.steps:
        name = one.action_id
        if len(steps) < len(one.steps) - 1:
            name = _unused(f"{one.action_id[:_LONGEST_STEM]}_{skill}", taken)
        own = one.fields if name == one.action_id else {
            key: one.fields[key] for key in ("priority",) if key in one.fields
        }  # fmt: skip
        steps.append(
            {**own, "id": name, "skill": skill, "parameters": dict(parameters),
             "depends_on": needs, "after": after}
        )  # fmt: skip
        needs, after = (name,), ()
    return steps


def _unused(name: str, taken: set[str]) -> str:
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name}_{number}"
    taken.add(free)
    return free
