"""Turn the three dialects that language models and older tools speak into the canonical plan.

canonical  id, skill, parameters, depends_on
typed      id, type, action, parameters, dependencies
ranked     action_type, parameters, priority
terse      action, params, description
"""

import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from pydantic import ValidationError

from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.errors import PlanInvalid
from vla_deploy.plans.plan import Plan

Json = dict[str, Any]

_DECODER: Final = json.JSONDecoder()
_BEGINNING: Final = re.compile(r"[{[]")
# Each may cost the parser a look at the whole text.
_MOST_BEGINNINGS: Final = 64

PLAN_LISTS = ("actions", "action_sequence", "plan", "steps", "primitives")
PLAN_GOALS = ("goal", "task", "command", "objective")
ACTION_KEYS: Mapping[str, tuple[str, ...]] = {
    "id": ("id", "action_id", "step"),
    "skill": ("skill", "action", "action_type", "name", "type"),
    "parameters": ("parameters", "params", "args", "arguments"),
    "depends_on": ("depends_on", "dependencies"),
    "after": ("after",),
    "description": ("description", "reason"),
    "priority": ("priority",),
    "estimated_duration_s": ("estimated_duration_s", "estimated_duration", "duration"),
    "feasibility_score": ("feasibility_score",),
    "resources": ("resources", "required_resources"),
    "preconditions": ("preconditions",),
    "effects": ("effects",),
}
_KNOWN_KEYS: Final = frozenset(alias for aliases in ACTION_KEYS.values() for alias in aliases)
# The typed dialect's `type` is a category next to `action`; it is dropped when a skill is named.
CATEGORIES = frozenset({"navigation", "manipulation", "interaction", "perception", "movement"})
PLAN_TEXTS = ("summary", "reasoning", "feasible", "safety_concerns", "success_criteria")
PRIORITIES = {"critical": "high", "normal": "medium"}

ParameterMap = Callable[[Json], Json]


def _distance(sign: float) -> ParameterMap:
    return lambda given: {
        "distance_m": sign * _number(given, "distance_m", "distance", default=0.5)
    }


def _angle(sign: float) -> ParameterMap:
    def convert(given: Json) -> Json:
        if "angle_deg" in given or "degrees" in given:
            angle_rad = math.radians(_number(given, "angle_deg", "degrees", default=90.0))
        else:
            angle_rad = _number(given, "angle_rad", "angle", default=math.pi / 2)
        return {"angle_rad": sign * angle_rad}

    return convert


def _target(given: Json) -> Json:
    point = given.get("position", given.get("pose", given.get("coordinates")))
    if isinstance(point, list) and len(point) >= 2:
        names = ("x_m", "y_m", "yaw_rad")
        return dict(
            zip(names, point[:2] if len(point) == 2 else (*point[:2], point[-1]), strict=False)
        )
    if isinstance(point, Mapping):
        given = {**given, **point}
    renamed = _rename(
        x="x_m", y="y_m", theta="yaw_rad", yaw="yaw_rad", location="place", target="place",
        destination="place", room="place", position="place",
    )(given)  # fmt: skip
    return {key: value for key, value in renamed.items() if not isinstance(value, Mapping)}


def _rename(**names: str) -> ParameterMap:
    return lambda given: {names.get(key, key): value for key, value in given.items()}


_OBJECT = _rename(object_name="object", target="object", item="object", object_id="object")
# What is put may be named with it: grounding fetches it first.
_PUT = _rename(
    location="destination", target="destination", container="destination", surface="destination",
    object_name="object", item="object", object_id="object",
)  # fmt: skip


# Each skill, what its parameters become, and the names that dialects have for it.
_SKILL_NAMES: Final[tuple[tuple[str, ParameterMap, tuple[str, ...]], ...]] = (
    ("navigate_to", _target, ("navigate_to", "navigate", "go_to", "move_to")),
    ("move", _distance(1.0), ("move_forward",)),
    ("move", _distance(-1.0), ("move_backward",)),
    ("turn", _angle(1.0), ("turn_left", "rotate")),
    ("turn", _angle(-1.0), ("turn_right",)),
    ("pick_up", _OBJECT, ("pick_up", "pick", "grasp", "grab")),
    ("place", _PUT, ("place", "put_down", "put", "put_away", "release", "drop")),
    ("hand_over", _OBJECT, ("hand_over", "handover", "give")),
    ("find_object", _OBJECT, ("find_object", "detect_object", "search")),
    ("look_at", _OBJECT, ("look_at",)),
    *(
        (
            f"turn_{state}",
            _rename(name="device", target="device"),
            (f"turn_{state}", f"switch_{state}"),
        )
        for state in ("on", "off")
    ),
    ("speak", _rename(message="text", speech="text"), ("speak", "say")),
    ("wait", _rename(duration="duration_s", seconds="duration_s", time="duration_s"), ("wait",)),
)
SKILL_DIALECT: Final = {
    name: (skill, convert) for skill, convert, names in _SKILL_NAMES for name in names
}


def parse_plan(document: str | Json | list[Any]) -> Plan:
    """Read a plan in any dialect, also when a model wrapped its JSON in prose.

    Raises:
        PlanInvalid: no JSON in the text, or what it holds is no plan; every fault is named.
    """
    found = _extract_json(document) if isinstance(document, str) else document
    try:
        return Plan.model_validate(_canonical_plan(found))
    except ValidationError as error:
        faults = [
            f"{'.'.join(map(str, fault['loc'])) or 'plan'}: {fault['msg']}"
            for fault in error.errors()
        ]
        raise PlanInvalid(faults) from error


def _extract_json(text: str) -> Any:
    """Return the first JSON object or list in a text; what is broken is skipped whole."""
    start = 0
    for _ in range(_MOST_BEGINNINGS):
        beginning = _BEGINNING.search(text, start)
        if beginning is None:
            break
        try:
            return _DECODER.raw_decode(text, beginning.start())[0]
        except json.JSONDecodeError as error:
            start = max(error.pos, beginning.end())
        except RecursionError:
            raise PlanInvalid(["the JSON is nested too deeply"]) from None
    raise PlanInvalid(["no JSON object found in the text"])


def _canonical_plan(document: Any) -> Json:
    if isinstance(document, list):
        document = {"actions": document}
    if not isinstance(document, Mapping):
        raise PlanInvalid([f"a plan is a JSON object or a list of actions, got {document!r:.60}"])
    listed: list[Any] = next(
        (document[key] for key in PLAN_LISTS if isinstance(document.get(key), list)), []
    )
    plan: Json = {key: document[key] for key in PLAN_TEXTS if key in document}
    plan["goal"] = next((document[key] for key in PLAN_GOALS if document.get(key)), "unnamed goal")
    plan["actions"] = []
    for number, action in enumerate(listed, start=1):
        previous = plan["actions"][-1]["id"] if plan["actions"] else None
        plan["actions"].append(_canonical_action(action, number, previous))
    return plan


def _canonical_action(action: Any, number: int, previous: str | None) -> Json:
    if not isinstance(action, Mapping):
        raise PlanInvalid([f"action {number} is no JSON object: {action!r:.60}"])
    given = {key: value for key, value in action.items() if value is not None}
    unknown = [key for key in given if key not in _KNOWN_KEYS]
    if unknown and any(key in given for key in ACTION_KEYS["parameters"]):
        raise PlanInvalid([f"action {number} has unknown keys: {', '.join(sorted(unknown))}"])
    if unknown:  # the parameters stand next to the skill
        given["parameters"] = {key: given.pop(key) for key in unknown}
    found = {key: _first(given, aliases) for key, aliases in ACTION_KEYS.items()}
    canonical = {key: value for key, value in found.items() if value is not None}
    canonical["id"] = str(canonical.get("id", f"a{number}"))
    if isinstance(canonical.get("depends_on"), list):
        canonical["depends_on"] = [str(name) for name in canonical["depends_on"]]
    elif "depends_on" not in canonical and previous is not None:
        canonical["depends_on"] = [previous]
    priority = canonical.get("priority")
    if isinstance(priority, str):
        canonical["priority"] = PRIORITIES.get(priority, priority)
    skill = str(canonical.get("skill", "")).strip().lower().replace(" ", "_")
    parameters = canonical.get("parameters", {})
    is_canonical = "skill" in given and skill in SKILLS
    if is_canonical or not isinstance(parameters, Mapping):
        return canonical | {"skill": skill}
    skill, convert = SKILL_DIALECT.get(skill, (skill, _rename()))
    return canonical | {"skill": skill, "parameters": convert(dict(parameters))}


def _first(action: Mapping[str, Any], aliases: tuple[str, ...]) -> Any:
    values = [action[alias] for alias in aliases if alias in action]
    if len(values) > 1:
        values = [value for value in values if str(value) not in CATEGORIES]
    return values[0] if values else None


def _number(given: Json, *names: str, default: float) -> float:
    value = next((given[name] for name in names if name in given), default)
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan  # the validator names it: "must be a number"
