"""Do what planning with any chat model has in common: the shape of its answer, and its proposal."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Final

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    WithJsonSchema,
    field_validator,
    model_validator,
)

from vla_deploy.planning.catalogue import SKILLS, Parameter, SkillSpec, Type
from vla_deploy.planning.dialects import PLAN_LISTS, parse_plan
from vla_deploy.planning.errors import Ambiguous, CannotBeDone, PlanInvalid
from vla_deploy.planning.interfaces import Aid, BackEnd, Proposal, Request
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.prompts.composing import plain

_REASON_CHARACTERS: Final = 400
_QUESTION_CHARACTERS: Final = 160
_MOST_STEPS: Final = 100
_MOST_ASKED: Final = 60
Schema = dict[str, Any]


class PlanAnswer(BaseModel):
    """Hold an answer whose steps can be read; whether they may run is checked elsewhere.

    `reasoning` comes first, so that a model thinks before it decides.
    """

    model_config = ConfigDict(extra="ignore")

    reasoning: str = ""
    question: str | None = None
    feasible: bool = True
    steps: tuple[dict[str, Any], ...] = Field(default=(), max_length=_MOST_STEPS)
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
        found = next(
            (document[key] for key in PLAN_LISTS if isinstance(document.get(key), list)), None
        )
        return document if found is None else {**document, "steps": found}

    @field_validator("reasoning")
    @classmethod
    def _short(cls, text: str) -> str:
        return plain(text, _REASON_CHARACTERS)

    @field_validator("question")
    @classmethod
    def _one_question(cls, text: str | None) -> str | None:
        return plain(text, _QUESTION_CHARACTERS) or None if text else None

    @model_validator(mode="after")
    def _is_readable(self) -> "PlanAnswer":
        """Read the steps once, so that the faults are sent back at once."""
        try:
            self.plan("")
        except PlanInvalid as error:
            raise ValueError("; ".join(error.faults)) from error
        return self

    def plan(self, goal: str) -> Plan:
        """Return the steps as a plan for a goal, as yet unchecked.

        Raises:
            PlanInvalid: they are none.
        """
        return parse_plan(
            {
                "goal": goal or "unnamed",
                "reasoning": self.reasoning,
                "feasible": self.feasible,
                "actions": [_cleaned(step) for step in self.steps],
            }
        )


def answer_for(places: Sequence[str]) -> type[PlanAnswer]:
    """Return the shape of answers for a robot that knows these places."""
    schema = _steps_schema(places)

    class Answer(PlanAnswer):
        steps: Annotated[tuple[dict[str, Any], ...], WithJsonSchema(schema)] = Field(
            default=(), max_length=_MOST_STEPS
        )

    Answer.__name__ = PlanAnswer.__name__  # it titles the schema that models read
    return Answer


def _steps_schema(places: Sequence[str]) -> Schema:
    """Return the JSON Schema of a list of steps, each a skill with its parameters next to it.

    Places are an enumeration; a parameter that may be left out may be null.
    """
    forms = [form for name, spec in SKILLS.items() for form in _forms(name, spec, places)]
    return {"type": "array", "maxItems": _MOST_ASKED, "items": {"anyOf": forms}}


def _forms(name: str, spec: SkillSpec, places: Sequence[str]) -> Iterator[Schema]:
    """Yield one form for each group of parameters of which exactly one is given."""
    choices = {one for group in spec.one_of for one in group}
    for group in spec.one_of or ((),):
        given: Schema = {}
        for key, parameter in spec.parameters.items():
            if key in group or key not in choices:
                schema = _typed(parameter, places)
                is_given = key in group or parameter.required
                given[key] = schema if is_given else {"anyOf": [schema, {"type": "null"}]}
        yield {
            "type": "object",
            "properties": {"skill": {"const": name}, **given},
            "required": ["skill", *given],
            "additionalProperties": False,
        }


def _typed(parameter: Parameter, places: Sequence[str]) -> Schema:
    match parameter.type:
        case Type.NUMBER:
            bounds = {"minimum": parameter.minimum, "maximum": parameter.maximum}
            return {"type": "number", **bounds}
        case Type.CHOICE:
            return {"type": "string", "enum": list(parameter.choices)}
        case Type.PLACE:
            return {"type": "string", "enum": list(places)}
        case _:
            return {"type": "string"}


def _cleaned(value: Any) -> Any:
    """Return what a model wrote without invisible characters."""
    if isinstance(value, str):
        return plain(value, 500)
    if isinstance(value, Mapping):
        return {plain(key): _cleaned(one) for key, one in value.items()}
    return [_cleaned(one) for one in value] if isinstance(value, list) else value


SURE: Final = 0.75
"""A plan of which a model is less sure is read back before anything moves."""


class ChatBackEnd(BackEnd):
    """Hold how the answers of one chat model become proposals; `shape` is that of an answer."""

    is_language_model = True
    uses = frozenset({Aid.MEMORY})

    def __init__(self, name: str, robot: str, places: Sequence[str]) -> None:
        self.name = name
        self.robot = robot
        self.shape = answer_for(places)

    def planned(self, answer: PlanAnswer, request: Request) -> Plan:
        """Return the plan that a model has answered, as yet unchecked.

        Raises:
            Ambiguous: the model asks something.
            CannotBeDone: the model sees no way, and says why.
        """
        if answer.question:
            raise Ambiguous(answer.question)
        if not answer.feasible or not answer.steps:
            reason = answer.reasoning or "it gives no reason"
            raise CannotBeDone(f"{self.name} sees no way to do it: {reason}")
        return answer.plan(request.text)

    def proposal(self, plan: Plan, confidence: float) -> Proposal:
        """Return a plan, which is read back where the model is not sure."""
        return Proposal(
            plan=plan,
            back_end=self.name,
            confidence=round(confidence, 3),
            is_unsure=confidence < SURE,
            knows_grammar=True,
        )
