"""Compose one question to a model: which templates, how much of the situation, which command."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.model_servers.chat import Chat, Message
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.plan import MOST_CHARACTERS
from vla_deploy.planning.prompts.fitting import fitted
from vla_deploy.planning.prompts.instructions import filled, limits_in_words, skills_in_words
from vla_deploy.planning.prompts.quoting import as_data, plain
from vla_deploy.planning.prompts.situation_data import situation_of

DEFAULT_ROOM: Final = 12_000
LEAST_ROOM: Final = 3_000
"""Characters of a prompt: about a quarter as many tokens."""

# Each variant is a way to ask for the same thing; which template files it is made of.
VARIANTS: Final[Mapping[str, tuple[str, ...]]] = {
    "few_shot": ("structured", "human_interaction", "few_shot"),
    "structured": ("structured", "human_interaction"),
    "chain_of_thought": ("structured", "human_interaction", "chain_of_thought"),
    "short": ("short",),
}
# What a variant gives way to where it leaves the situation too little room.
_SMALLER: Final[Mapping[str, str]] = {
    "few_shot": "structured",
    "chain_of_thought": "structured",
    "structured": "short",
}
# Enough for what failed and all that was done before it.
_FAILURE_CHARACTERS: Final = 600
_LEAST_DATA: Final = 1_500


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """Say how to ask: the variant, with which picture (JPEG), and after which failures.

    `refused` are the faults of the plan that was proposed to this very question.
    """

    variant: str = "few_shot"
    jpeg: bytes | None = None
    failed: tuple[str, ...] = ()


def chat_for(request: Request, robot: str, wish: Wish, room: int = DEFAULT_ROOM) -> Chat:
    """Return the question; instructions and data together take at most `room` characters."""
    data_room, system = _system(request, robot, wish, room)
    situation: dict[str, Any] = situation_of(request)
    if wish.failed:
        situation["failed_before"] = [plain(one, _FAILURE_CHARACTERS) for one in wish.failed]
    command = as_data(plain(request.text, MOST_CHARACTERS))
    told = as_data(fitted(situation, data_room - len(command)))
    text = f"<situation>\n{told}\n</situation>\n<command>{command}</command>"
    images = () if wish.jpeg is None else (wish.jpeg,)
    return Chat(system=system, messages=(Message(text=text, images=images),), schema_name="plan")


def _system(request: Request, robot: str, wish: Wish, room: int) -> tuple[int, str]:
    """Return the instructions, smaller ones where they must be, and the room they leave."""
    variant = wish.variant
    while True:
        system = _instructions(request, robot, VARIANTS[variant], wish)
        left = room - len(system) - _TAGS
        if left >= _LEAST_DATA or variant not in _SMALLER:
            return max(left, 0), system
        variant = _SMALLER[variant]


def _instructions(request: Request, robot: str, parts: Sequence[str], wish: Wish) -> str:
    more = [*(("scene_analysis",) if wish.jpeg else ()), *(("recovery",) if wish.failed else ())]
    fields = {
        "robot": plain(robot),
        "skills": skills_in_words(),
        "limits": limits_in_words(request.world),
    }
    return "\n\n".join(filled(part, **fields) for part in (*parts, *more))


_TAGS: Final = len("<situation>\n\n</situation>\n<command></command>")
