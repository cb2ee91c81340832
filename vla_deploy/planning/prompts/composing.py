"""Compose one question to a model: instructions from template files, everything else as data."""

import math
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from string import Template
from typing import Any, Final

from vla_deploy.model_servers.chat import Chat, Message
from vla_deploy.planning.bounds import MOST_CHARACTERS
from vla_deploy.planning.catalogue import SKILLS, Parameter, Type
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.prompts.situation_data import as_data, fitted, plain, situation_of
from vla_deploy.world.vocabulary import OBJECT_CLASSES

TEMPLATES: Final = Path(__file__).parent
DEFAULT_ROOM: Final = 12_000
"""Characters of a prompt: about a quarter as many tokens."""
# Each variant is a way to ask for the same thing; which template files it is made of.
VARIANTS: Final[Mapping[str, tuple[str, ...]]] = {
    "few_shot": ("structured", "human_interaction", "few_shot"),
    "chain_of_thought": ("structured", "human_interaction", "chain_of_thought"),
    "structured": ("structured", "human_interaction"),
    "short": ("short",),
}
# What a variant gives way to where it leaves the situation too little room.
_SHORTER: Final[Mapping[str, tuple[str, ...]]] = {
    "few_shot": ("structured", "short"),
    "chain_of_thought": ("structured", "short"),
    "structured": ("short",),
    "short": (),
}
# Enough for what failed and all that was done before it.
_FAILURE_CHARACTERS: Final = 600
_LEAST_DATA: Final = 1_500
_TAGS: Final = len("<situation>\n\n</situation>\n<command></command>")
_UNITS: Final = {"_m": "m", "_rad": "rad", "_s": "s"}


def chat_for(
    request: Request,
    robot: str,
    variant: str = "few_shot",
    room: int = DEFAULT_ROOM,
    jpeg: bytes | None = None,
) -> Chat:
    """Return the question; instructions and data together take at most `room` characters.

    Where the variant leaves the situation too little room, shorter instructions are taken.
    """
    more = [*(("scene_analysis",) if jpeg else ()), *(("recovery",) if request.failed else ())]
    fields = {
        "robot": plain(robot),
        "skills": skills_in_words(),
        "limits": limits_in_words(request.world),
    }
    for name in (variant, *_SHORTER[variant]):
        system = "\n\n".join(filled(part, **fields) for part in (*VARIANTS[name], *more))
        data_room = room - len(system) - _TAGS
        if data_room >= _LEAST_DATA:
            break
    situation: dict[str, Any] = situation_of(request)
    if request.failed:
        failed = [plain(one, _FAILURE_CHARACTERS) for one in request.failed]
        situation["failed_before"] = failed
    command = as_data(plain(request.text, MOST_CHARACTERS))
    data = as_data(fitted(situation, max(data_room, 0) - len(command)))
    text = f"<situation>\n{data}\n</situation>\n<command>{command}</command>"
    images = () if jpeg is None else (jpeg,)
    return Chat(system=system, messages=(Message(text=text, images=images),), schema_name="plan")


def filled(name: str, **fields: str) -> str:
    """Return the text of a template file with its fields filled."""
    return _template(name).substitute(fields).strip()


@cache
def _template(name: str) -> Template:
    return Template((TEMPLATES / f"{name}.md").read_text(encoding="utf-8"))


@cache
def skills_in_words() -> str:
    """Return every skill on a line: its name, its parameters with their ranges, what it does."""
    lines = []
    for name, spec in SKILLS.items():
        parameters = ", ".join(
            f"{key}{'' if one.required else '?'}{_range(key, one)}"
            for key, one in spec.parameters.items()
        )
        lines.append(f"- {name}({parameters}): {spec.summary}")
    return "\n".join(lines)


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


def _range(name: str, parameter: Parameter) -> str:
    if parameter.type is Type.CHOICE:
        return f" {'|'.join(parameter.choices)}"
    if parameter.type is not Type.NUMBER:
        return ""
    unit = next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "")
    return f" {parameter.minimum:.4g}..{parameter.maximum:.4g} {unit}".rstrip()
