"""Define the answer that a chat model gives to a command, and its JSON Schema for a robot."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, WithJsonSchema, model_validator

from vla_deploy.planning.prompts.composing import plain
from vla_deploy.plans.catalogue import SKILLS, SWITCHING, SkillParameter, SkillSpec, Type
from vla_deploy.plans.dialects import LISTS, parse_plan
from vla_deploy.plans.plan import MOST_ACTIONS, Plan

_REASON_CHARACTERS: Final = 400
_QUESTION_CHARACTERS: Final = 160
_MOST_ASKED: Final = 60
Schema = dict[str, Any]
Names = Mapping[Type, Sequence[str]]
"""What may be named by each type of parameter that is an enumeration."""


class PlanAnswer(BaseModel):
    """Hold an answer; whether its steps may run is checked elsewhere.

    `reasoning` comes first, so that a model thinks before it decides.
    """

    model_config = ConfigDict(extra="ignore")

    reasoning: Annotated[str, AfterValidator(lambda text: plain(text, _REASON_CHARACTERS))] = ""
    question: Annotated[
        str | None, AfterValidator(lambda text: plain(text or "", _QUESTION_CHARACTERS) or None)
    ] = None
    feasible: bool = True
    steps: tuple[dict[str, Any], ...] = Field(default=(), max_length=MOST_ACTIONS)
    confidence: float = Field(default=0.5, ge=0.0, le=1.0)

    @model_validator(mode="before")
    @classmethod
    def _from_any_dialect(cls, document: Any) -> Any:
        """Call the list of steps by its name here; older tools wrap it in `plan`, too."""
        if not isinstance(document, Mapping):
            return document
        inner = document.get("plan")
        if isinstance(inner, Mapping):
            document = {**document, **inner}
        found = next((document[key] for key in LISTS if isinstance(document.get(key), list)), None)
        return document if found is None else {**document, "steps": found}

    def plan(self, goal: str) -> Plan:
        """Return the steps as a plan for a goal, as yet unchecked.

        Raises:
            PlanInvalid: they are none.
        """
        actions = [_cleaned(step) for step in self.steps]
        return parse_plan({"goal": goal, "reasoning": self.reasoning, "actions": actions})


def answer_for(
    places: Sequence[str], devices: Sequence[str] = (), skills: Collection[str] = SKILLS
) -> type[PlanAnswer]:
    """Return the shape of answers for a robot with these skills, places, and devices of the home.

    Each step is a skill with its parameters next to it; places and devices are enumerations, and a
    parameter that may be left out may be null.
    """
    names = {Type.PLACE: places, Type.DEVICE: devices}
    forms = [
        form
        for name, spec in SKILLS.items()
        if name in skills and (devices or name not in SWITCHING)
        for form in _forms(name, spec, names)
    ]
    schema = {"type": "array", "maxItems": _MOST_ASKED, "items": {"anyOf": forms}}

    class Answer(PlanAnswer):
        steps: Annotated[tuple[dict[str, Any], ...], WithJsonSchema(schema)] = Field(
            default=(), max_length=MOST_ACTIONS
        )

    Answer.__name__ = PlanAnswer.__name__  # it titles the schema that models read
    return Answer


def _forms(name: str, spec: SkillSpec, names: Names) -> Iterator[Schema]:
    """Yield one form for each group of parameters of which exactly one is given."""
    choices = {one for group in spec.one_of for one in group}
    for group in spec.one_of or ((),):
        given: Schema = {}
        for key, parameter in spec.parameters.items():
            if key in group or key not in choices:
                schema = _typed(parameter, names)
                is_given = key in group or parameter.required
                given[key] = schema if is_given else {"anyOf": [schema, {"type": "null"}]}
        yield {
            "type": "object",
            "properties": {"skill": {"const": name}, **given},
            "required": ["skill", *given],
            "additionalProperties": False,
        }


def _typed(parameter: SkillParameter, names: Names) -> Schema:
    match parameter.type:
        case Type.NUMBER:
            bounds = {"minimum": parameter.minimum, "maximum": parameter.maximum}
            return {"type": "number", **bounds}
        case Type.CHOICE:
            return {"type": "string", "enum": list(parameter.choices)}
        case Type.FLAG:
            return {"type": "boolean"}
        case Type.PLACE | Type.DEVICE as kind:
            return {"type": "string", "enum": list(names[kind])}
        case _:
            return {"type": "string"}


def _cleaned(value: Any) -> Any:
    """Return what a model wrote without invisible characters."""
    if isinstance(value, str):
        return plain(value, 500)
    if isinstance(value, Mapping):
        return {plain(key): _cleaned(one) for key, one in value.items()}
    return [_cleaned(one) for one in value] if isinstance(value, list) else value
