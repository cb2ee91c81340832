"""Write the catalogue as a JSON Schema of steps: a constrained model can write nothing else."""

from collections.abc import Iterator, Sequence
from typing import Any, Final

from vla_deploy.planning.catalogue import SKILLS, Parameter, SkillSpec, Type

Schema = dict[str, Any]
_NULL: Final[Schema] = {"type": "null"}
_MOST_STEPS: Final = 60


def steps_schema(places: Sequence[str]) -> Schema:
    """Return the schema of a list of steps, each a skill with its parameters beside it.

    Places are an enumeration; a parameter that may be left out may be null.
    """
    forms = [form for name, spec in SKILLS.items() for form in _forms(name, spec, places)]
    return {"type": "array", "maxItems": _MOST_STEPS, "items": {"anyOf": forms}}


def _forms(name: str, spec: SkillSpec, places: Sequence[str]) -> Iterator[Schema]:
    """Yield one form for each group of parameters of which exactly one is given."""
    choices = {one for group in spec.one_of for one in group}
    for group in spec.one_of or ((),):
        given = {
            key: _of(parameter, places, is_given=key in group or parameter.required)
            for key, parameter in spec.parameters.items()
            if key in group or key not in choices
        }
        yield {
            "type": "object",
            "properties": {"skill": {"const": name}, **given},
            "required": ["skill", *given],
            "additionalProperties": False,
        }


def _of(parameter: Parameter, places: Sequence[str], *, is_given: bool) -> Schema:
    schema = _typed(parameter, places)
    return schema if is_given else {"anyOf": [schema, _NULL]}


def _typed(parameter: Parameter, places: Sequence[str]) -> Schema:
    match parameter.type:
        case Type.NUMBER:
            return {
                "type": "number",
                "minimum": parameter.minimum,
                "maximum": parameter.maximum,
            }
        case Type.CHOICE:
            return {"type": "string", "enum": list(parameter.choices)}
        case Type.PLACE:
            return {"type": "string", "enum": list(places)}
        case _:
            return {"type": "string"}
