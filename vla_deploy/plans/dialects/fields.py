"""Read the keys of an action beside its skill: id, order, priority, duration and their like."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.dialects import values
from vla_deploy.plans.dialects.findings import Findings
from vla_deploy.plans.dialects.values import Json, NotMeant, ValueReading
from vla_deploy.plans.plan import PRIORITIES
from vla_deploy.plans.symbolic.table import LOGIC

KEYS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "id": ("id", "action_id", "step"),
        "skill": ("skill", "action", "action_type", "name", "type"),
        "parameters": ("parameters", "params", "args", "arguments"),
        "depends_on": ("depends_on", "dependencies"),
        "after": ("after",),
        "description": ("description", "reason", "resolution_notes"),
        "priority": ("priority",),
        "estimated_duration_s": ("estimated_duration_s", "estimated_duration", "duration"),
        "feasibility_score": ("feasibility_score",),
        "resources": ("resources", "required_resources"),
        "preconditions": ("preconditions",),
        "effects": ("effects",),
    }
)
UNUSED: Final[Mapping[str, str]] = MappingProxyType(
    {
        "status": "not used, the executor keeps it",
        "result": "not used, the executor keeps it",
        "timestamp": "not used",
        "success_criteria": "not used, the effect of each skill is verified after it",
        "safety_check": "not taken, each action is checked before it begins",
    }
)
"""What documents say of an action beside that, and why it changes nothing."""
KNOWN: Final = frozenset({alias for aliases in KEYS.values() for alias in aliases} | set(UNUSED))
WORDS_FOR_PRIORITIES: Final = MappingProxyType({**PRIORITIES, "critical": 1, "normal": 2})


def given_field(
    action: Json, field: str, action_id: str, findings: Findings
) -> tuple[str, Any] | None:
    """Return under which key a field is given, and its value."""
    told = [(key, action[key]) for key in KEYS[field] if key in action]
    for key, value in told[1:]:
        if value == told[0][1]:
            continue
        if field in ("parameters", "depends_on"):
            findings.fault(action_id, f"{told[0][0]} and {key} differ; leave one out")
        else:
            findings.note(action_id, key, value, f"not used, {told[0][0]} says it")
    return told[0] if told else None


def canonical_fields(action: Json, action_id: str, skill: str, findings: Findings) -> Json:
    """Return the canonical fields that do not depend on other actions."""
    fields: Json = {}
    for name, read in _FIELDS.items():
        told = given_field(action, name, action_id, findings)
        taken = None if told is None else findings.read(action_id, *told, read)
        fields |= {} if taken is None else taken.parameters
    for key, why in UNUSED.items():
        if key in action:
            findings.note(action_id, key, action[key], why)
    for name, own in _own_words(skill).items():
        if not {*fields.get(name, ())} <= {*own}:
            key = next(one for one in KEYS[name] if one in action)
            del fields[name]
            known = ", ".join(own) or "verified as the robot knows it"
            findings.note(action_id, key, action[key], f"not used, of {skill} it is: {known}")
    return fields


def _own_words(skill: str) -> Mapping[str, tuple[str, ...]]:
    """Return what the tables say of a skill, which is what is checked, whatever its author says."""
    spec, logic = SKILLS.get(skill), LOGIC.get(skill)
    if spec is None or logic is None:
        return {}
    return {"resources": spec.resources, "preconditions": (*logic.needs,), "effects": ()}


def _priority(value: Any) -> ValueReading:
    expected = "a whole number, 1 first, or high, medium, low"
    if isinstance(value, str) and value.strip().lower() in WORDS_FOR_PRIORITIES:
        return ValueReading({"priority": WORDS_FOR_PRIORITIES[value.strip().lower()]})
    if isinstance(value, int) and not isinstance(value, bool):
        return ValueReading({"priority": value})
    found = values.number_of(value, expected)
    if found != int(found):
        raise NotMeant(expected)
    return ValueReading({"priority": int(found)})


def _score(value: Any) -> ValueReading:
    found = values.number_of(value, "a number from 0 to 1")
    if not 0.0 <= found <= 1.0:
        raise NotMeant("a number from 0 to 1")
    return ValueReading({"feasibility_score": found})


def _how_long(value: Any) -> ValueReading:
    found = values.number_of(value, "a number of s, 0 or more", values.DURATIONS_S)
    if found < 0.0:
        raise NotMeant("a number of s, 0 or more")
    return ValueReading({"estimated_duration_s": found})


def _texts(name: str) -> values.Read:
    def read(value: Any) -> ValueReading:
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list) or not all(isinstance(one, str) for one in listed):
            raise NotMeant("a text, or a list of texts")
        return ValueReading({name: tuple(listed)})

    return read


def _description(value: Any) -> ValueReading:
    if not isinstance(value, str):
        raise NotMeant("a text")
    return ValueReading({"description": value})


_FIELDS: Final[Mapping[str, values.Read]] = MappingProxyType(
    {
        "description": _description,
        "estimated_duration_s": _how_long,
        "priority": _priority,
        "feasibility_score": _score,
        **{name: _texts(name) for name in ("resources", "preconditions", "effects")},
    }
)


def named_ids(
    action: Json, field: str, action_id: str, findings: Findings
) -> tuple[str, ...] | None:
    """Return the ids of other actions, None where the author has named none."""
    told = given_field(action, field, action_id, findings)
    taken = None if told is None else findings.read(action_id, *told, _named_actions)
    return None if taken is None else tuple(taken.parameters["ids"])


def _named_actions(value: Any) -> ValueReading:
    listed = [value] if isinstance(value, str | int) else value
    if not isinstance(listed, list) or not all(
        isinstance(one, str | int) and not isinstance(one, bool) for one in listed
    ):
        raise NotMeant('a list of ids, such as ["nav_001"]')
    return ValueReading({"ids": tuple(str(one).strip() for one in listed)})
