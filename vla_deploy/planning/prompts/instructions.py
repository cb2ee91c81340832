"""Fill the template files with what the robot can do and must not do."""

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from string import Template
from typing import Final

from vla_deploy.planning.catalogue import SKILLS, Parameter, SkillSpec, Type
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.prompts.quoting import plain
from vla_deploy.world.vocabulary import OBJECT_CLASSES

TEMPLATES: Final = Path(__file__).parent
_UNITS: Final = {"_m": "m", "_rad": "rad", "_s": "s"}


def filled(name: str, **fields: str) -> str:
    """Return the text of a template file with its fields filled."""
    return _template(name).substitute(fields).strip()


@cache
def _template(name: str) -> Template:
    return Template((TEMPLATES / f"{name}.md").read_text(encoding="utf-8"))


@cache
def skills_in_words() -> str:
    """Return every skill on a line: its name, its parameters with their ranges, what it does."""
    return "\n".join(
        f"- {name}({', '.join(_parameters(spec))}): {spec.summary}" for name, spec in SKILLS.items()
    )


def limits_in_words(world: World) -> str:
    """Return what bounds a plan for this robot, a line each."""
    return "\n".join(f"- {one}" for one in _limits(world))


def _limits(world: World) -> Iterator[str]:
    yield f"it recognises these kinds of things: {', '.join(OBJECT_CLASSES)}"
    yield f"at most {world.bounds.max_actions} steps"
    if math.isfinite(world.bounds.payload_kg):
        yield f"a hand carries at most {world.bounds.payload_kg:g} kg"
    if world.opening_max_m is not None:
        yield f"a hand opens {world.opening_max_m:.2f} m wide; what is wider cannot be taken"
    if world.poses:
        yield f"poses of the arms: {', '.join(sorted(map(plain, world.poses)))}"
    for zone in world.zones:
        yield f"it must not enter {plain(zone.name)}: {plain(zone.reason, 120)}"
    yield "it handles no people, animals, fire, blades, medicine or hot liquids"


def _parameters(spec: SkillSpec) -> Iterator[str]:
    for name, parameter in spec.parameters.items():
        optional = "" if parameter.required else "?"
        yield f"{name}{optional}{_range(name, parameter)}"


def _range(name: str, parameter: Parameter) -> str:
    if parameter.type is Type.CHOICE:
        return f" {'|'.join(parameter.choices)}"
    if parameter.type is not Type.NUMBER:
        return ""
    unit = next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "")
    return f" {parameter.minimum:.4g}..{parameter.maximum:.4g} {unit}".rstrip()
