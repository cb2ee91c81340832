"""Read one action of an author's plan: its keys, and the skills and parameters that they mean."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.plans.catalogue import SKILLS, SkillKind
from vla_deploy.plans.dialects.fields import (
    KEYS,
    KNOWN,
    canonical_fields,
    given_field,
    named_ids,
)
from vla_deploy.plans.dialects.findings import Findings, shown
from vla_deploy.plans.dialects.forms import DESCRIPTOR, REFUSED, ActionForm, form_of
from vla_deploy.plans.dialects.values import POINT, Json, ValueReading
from vla_deploy.plans.plan import Skill

CATEGORIES: Final = frozenset(SkillKind)
LONGEST_ID: Final = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionReading:
    """Hold one action as it was read.

    `steps` are the skills that it became, the last is its own. `fields` are those of the canonical
    action that do not depend on others. `needs` and `after` are ids, None where none are told.
    """

    action_id: str
    steps: tuple[Skill, ...]
    fields: Json
    needs: tuple[str, ...] | None
    after: tuple[str, ...] | None

    @property
    def is_ordered(self) -> bool:
        """Return whether its author has said what comes before it."""
        return self.needs is not None or self.after is not None


def read_action(action: Any, number: int, findings: Findings) -> ActionReading | None:
    """Return one action of a plan, the `number`th; None where it has a fault."""
    if not isinstance(action, Mapping):
        findings.fault(f"a{number}", f"expected a JSON object, got {shown(action)}")
        return None
    given = {key: value for key, value in action.items() if value is not None}
    action_id = _id_of(given, number, findings)
    name = _name_of(given, action_id, findings)
    if name is None:
        return None
    fields, parameters = _split(given, name)
    parameters = _parameters_of(fields, parameters, action_id, findings)
    steps = _steps(action_id, name, parameters, findings, is_canonical=given.get("skill") == name)
    return ActionReading(
        action_id=action_id,
        steps=steps,
        fields=canonical_fields(fields, action_id, steps[-1][0], findings),
        needs=named_ids(fields, "depends_on", action_id, findings),
        after=named_ids(fields, "after", action_id, findings),
    )


def _id_of(action: Json, number: int, findings: Findings) -> str:
    own = f"a{number}"
    _, value = given_field(action, "id", own, findings) or ("id", own)
    is_name = isinstance(value, str | int) and not isinstance(value, bool)
    name = str(value).strip() if is_name else ""
    if name.isprintable() and 0 < len(name) <= LONGEST_ID:
        return name
    findings.fault(own, f"its id must be a text of 1 to {LONGEST_ID} letters; got {shown(value)}")
    return own


# --- what it is called --------------------------------------------------------------------------


def _name_of(action: Json, action_id: str, findings: Findings) -> str | None:
    """Return what an action is called; the kind of action and a title are noted beside that."""
    told = {key: action[key] for key in KEYS["skill"] if key in action}
    wrong = [f"{key} {shown(value)}" for key, value in told.items() if not isinstance(value, str)]
    if wrong or not told:
        got = wrong[0] if wrong else f"only the keys {', '.join(action)}" if action else "no keys"
        findings.fault(action_id, f'it names no action; got {got:.80}, write "action": "pick_up"')
        return None
    names = {key: re.sub(r"[\s-]+", "_", one.strip().lower()) for key, one in told.items()}
    key = next((key for key, one in names.items() if one not in CATEGORIES), next(iter(names)))
    name = names.pop(key)
    form = form_of(name)
    for other, one in names.items():
        if form_of(one) is form or one == name:
            continue
        if other in ("action", "action_type") and one not in CATEGORIES:
            findings.fault(action_id, f'{key} "{name}" and {other} "{one}" differ; leave one out')
        elif one not in _kinds_of(form):
            findings.note(action_id, other, told[other], f"not used, {key} names the action")
    if name in REFUSED:
        findings.fault(action_id, f'{key} "{name}": {REFUSED[name]}')
        return None
    return name


def _kinds_of(form: ActionForm) -> tuple[str, ...]:
    """Return which kinds of action documents count it among."""
    spec = SKILLS.get(form.skill)
    if spec is None:  # of a skill that another robot may have, any kind may be right
        return tuple(SkillKind)
    is_way = spec.kind is SkillKind.MOVEMENT
    return (spec.kind, SkillKind.NAVIGATION) if is_way else (spec.kind,)


# --- its parameters -----------------------------------------------------------------------------


def _split(action: Json, name: str) -> tuple[Json, Json]:
    """Return the fields of an action, and what else stands next to them.

    Without parameters under a key of their own, those are the parameters of the skill, and so is a
    field of which the skill has a parameter: to wait has a `duration`.
    """
    form, is_flat = form_of(name), not any(key in action for key in KEYS["parameters"])
    fields = {
        key: value
        for key, value in action.items()
        if key in KNOWN and not (is_flat and key not in KEYS["skill"] and form.parameter(key))
    }
    return fields, {key: value for key, value in action.items() if key not in fields}


def _parameters_of(fields: Json, beside: Json, action_id: str, findings: Findings) -> Json:
    """Return what is given to the skill: under a key of its own, or next to the skill."""
    told = given_field(fields, "parameters", action_id, findings)
    if told is None:
        return beside
    key, value = told
    if beside:
        findings.fault(action_id, f"unknown keys: {', '.join(sorted(beside))}; what the skill "
                       f"takes stands in {key}")  # fmt: skip
    if not isinstance(value, Mapping):
        findings.fault(action_id, f'{key} must be an object such as {{"object": "red cup"}}; '
                       f"got {shown(value)}")  # fmt: skip
        return {}
    return {one: inner for one, inner in value.items() if inner is not None}


def _steps(
    action_id: str, name: str, given: Json, findings: Findings, *, is_canonical: bool
) -> tuple[Skill, ...]:
    """Return the skills of an action with their parameters, the way first where one is told."""
    form = form_of(name)
    known = {key: value for key, value in given.items() if form.parameter(key)}
    own, way, source = _read_parameters(action_id, form, known, findings)
    for key, value in {} if is_canonical else form.default.items():
        if key not in own:
            own[key] = value
            findings.note(action_id, name, None, f"{key} {value:.4g}, as the plan says nothing")
    if form.note:
        findings.note(action_id, name, None, form.note)
    _describe(own)
    if POINT in own:
        _settle_point(action_id, form, own, source[POINT], findings)
    if POINT in way:
        way |= _on_floor(action_id, way.pop(POINT), source[POINT], findings)
    for key, value in given.items():  # of what has no form the validator says what is taken
        if key not in known and own.setdefault(key, value) != value:
            findings.fault(action_id, f"{source.get(key, name)} and {key} differ; leave one out")
    return ((("navigate_to", way),) if way else ()) + ((form.skill, own),)


def _read_parameters(
    action_id: str, form: ActionForm, given: Json, findings: Findings
) -> tuple[Json, Json, dict[str, str]]:
    """Return the parameters of the skill, those of the way there, and which key each is from."""
    own: Json = {}
    way: Json = {}
    source: dict[str, str] = {}
    for key, value in given.items():
        row = form.parameter(key)
        assert row is not None, "what has no form is not read"
        taken = findings.read(action_id, key, value, row.read) or ValueReading()
        into = way if row.of_way else own
        for name, one in taken.parameters.items():
            if into.get(name, one) != one:
                findings.fault(action_id, f"{source[name]} and {key} differ; leave one out")
            into[name], source[name] = one, key
    return own, way, source


def _describe(own: Json) -> None:
    """Put what describes a thing before its name: "red" and "cup" are the red cup."""
    said = own.pop(DESCRIPTOR, None)
    if said is None:
        return
    thing = str(own.get("object", "one")).split()
    own["object"] = " ".join([*(word for word in said.split() if word not in thing), *thing])


def _settle_point(
    action_id: str, form: ActionForm, own: Json, key: str, findings: Findings
) -> None:
    """Take a point as the goal, unless that has a name, too: what is named is looked for."""
    spot = own.pop(POINT)
    names = ("destination",) if form.skill == "place" else ("place", "object")
    named = next((own[name] for name in names if name in own), None)
    if named is not None:
        findings.note(action_id, key, [*spot.values()], f'not used, it goes by "{named}"')
    elif form.skill == "place":
        findings.fault(
            action_id,
            f"{key} must be furniture or a thing, not a point: things are put on what is seen; "
            f'got {shown([*spot.values()])}, write "kitchen table"',
        )
    else:
        own.update(_on_floor(action_id, spot, key, findings))


def _on_floor(action_id: str, spot: Json, key: str, findings: Findings) -> Json:
    z_m = spot.pop("z_m", 0.0)
    if z_m:
        findings.note(action_id, key, f"z {z_m:g}", "not used, the base drives on the floor")
    return spot
