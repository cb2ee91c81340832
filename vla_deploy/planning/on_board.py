"""Open the models on board that plan: the command parser, then the one that a profile names."""

import dataclasses
import logging
from dataclasses import dataclass, field
from typing import Final

from platforms import ModelChoice, Profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.manifest import Use
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.providers import CPU
from vla_deploy.inference.roles import ModelShelf, tier_name
from vla_deploy.inference.store import Model
from vla_deploy.one_line import one_line
from vla_deploy.planning.command_parser.rung import NAME, CommandParser, open_command_parser
from vla_deploy.planning.ladder import Check
from vla_deploy.planning.language_model.rung import ChatRung, open_chat_rung
from vla_deploy.robots import RobotDescription

ROLE: Final = "planner"
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class OnBoard:
    """Hold the rungs that were opened, and why others are away."""

    rungs: tuple[CommandParser | ChatRung, ...] = ()
    away: dict[str, str] = field(default_factory=dict)

    def close(self) -> None:
        """Release the memory of all of them."""
        for rung in self.rungs:
            rung.close()


def open_on_board(
    robot: RobotDescription, profile: Profile, shelf: ModelShelf, check: Check, model_tier: int = 0
) -> OnBoard:
    """Open what a profile names for the role, `model_tier` steps below the best.

    The command parser that comes with the software goes before any larger model, since it answers
    in a fraction of the time. What cannot be opened is told in `away`, and done without.
    """
    choice = profile.models.get(ROLE)
    if choice is None:
        return OnBoard()
    opened: list[CommandParser | ChatRung] = []
    away: dict[str, str] = {}
    for name in dict.fromkeys((NAME, tier_name(choice, model_tier))):
        try:
            opened.append(_open(robot, shelf, shelf.store.load(name), choice, check))
        except InferenceError as error:
            away[name] = one_line(error)
            _log.warning("degraded: planning does without %s: %s", name, away[name])
    return OnBoard(rungs=tuple(opened), away=away)


def _open(
    robot: RobotDescription, shelf: ModelShelf, model: Model, choice: ModelChoice, check: Check
) -> CommandParser | ChatRung:
    language = model.manifest.language
    if language is not None and language.use is Use.COMMAND_PARSER:
        # So small a model is done on the CPU before a GPU has begun.
        on_cpu = dataclasses.replace(
            PLAIN_CHOICE, providers=(CPU,), threads=1, memory_arena=choice.memory_arena
        )
        return shelf.load(model, on_cpu, lambda: open_command_parser(model, on_cpu))
    return shelf.load(model, choice, lambda: open_chat_rung(model, choice, robot, check))
