"""Build the planner that a profile asks for; models that cannot be opened are skipped."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from drivers.clock import Clock, MonotonicClock
from platforms import ModelChoice, Profile
from platforms.profile import PlanningSettings
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.language_model import open_language_model
from vla_deploy.inference.manifest import LanguageUse
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.roles import ModelShelf, tier_name
from vla_deploy.inference.store import StoredModel
from vla_deploy.memory import Embedder, MemoryStore, MemoryUnusable
from vla_deploy.model_servers.errors import ModelServerError
from vla_deploy.model_servers.shelf import ServerShelf
from vla_deploy.planning.chat_models.chat_model import LocalModel, ServedModel
from vla_deploy.planning.chat_models.plan_answer import PlanAnswer, answer_for
from vla_deploy.planning.command_parser.rung import NAME, CommandParser, open_command_parser
from vla_deploy.planning.interfaces import BackEnd
from vla_deploy.planning.planner import Planner, checked
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.one_line import one_line

ROLE: Final = "planner"
_log = logging.getLogger(__name__)


def planner_for(
    robot: RobotDescription,
    profile: Profile,
    clock: Clock,
    base: Path,
    model_tier: int = 0,
    *,
    run_dir: Path | None = None,
) -> Planner:
    """Return a planner for a robot, with the models on board that a profile names.

    `model_tier` is how many steps below the best; `base` is the runtime directory, and `run_dir`
    that of the run in which the models claim their memory, None for none.
    """
    shelf = (
        ModelShelf.of_base(base, clock) if run_dir is None else ModelShelf.of_run(run_dir, clock)
    )
    local, away = open_local_models(robot, profile, shelf, model_tier)
    return open_planner(robot, profile.planning, clock, base, local, away)


def open_planner(
    robot: RobotDescription,
    settings: PlanningSettings,
    clock: Clock,
    base: Path,
    local: Sequence[BackEnd] = (),
    models_away: Mapping[str, str] | None = None,
) -> Planner:
    """Return a planner for a robot: patterns, models on board, servers, the parser.

    `base` is the runtime directory, where `servers.toml` lies; `models_away` maps models that could
    not be opened to the reason. Nothing is sent yet.
    """
    away = dict(models_away or {})
    servers: list[BackEnd] = []
    for name in settings.servers:
        try:
            # A server answers by the wall clock, whatever time the robot lives by.
            server = ServerShelf.of_base(base, MonotonicClock()).open(name)
        except ModelServerError as error:
            away[name] = one_line(error)
            _log.warning("planning does without server %s: %s", name, away[name])
        else:
            servers.append(ServedModel(server, robot.name, _shape(robot), checked))
    return Planner(clock, (*local, *servers), within_s=settings.within_s, away=away)


def _shape(robot: RobotDescription) -> type[PlanAnswer]:
    return answer_for(sorted(robot.places), sorted(robot.devices), world_of(robot, {}).skills)


def open_local_models(
    robot: RobotDescription, profile: Profile, shelf: ModelShelf, model_tier: int = 0
) -> tuple[tuple[BackEnd, ...], dict[str, str]]:
    """Open the models on board that plan; return them, and why others are away.

    The command parser that comes with the software is always one of them.
    """
    choice = profile.models.get(ROLE)
    if choice is None:
        return (), {}
    opened: list[BackEnd] = []
    away: dict[str, str] = {}
    for name in dict.fromkeys((NAME, tier_name(choice, model_tier))):
        try:
            opened.append(_open(robot, shelf, shelf.store.load(name), choice))
        except InferenceError as error:
            away[name] = one_line(error)
            _log.warning("degraded: planning does without %s: %s", name, away[name])
    return tuple(opened), away


def open_memory(
    settings: PlanningSettings, base: Path, embedder: Embedder | None = None
) -> MemoryStore | None:
    """Return the robot's memory, None where the profile wants none or its file cannot be used."""
    if settings.remembered == 0:
        return None
    try:
        return MemoryStore.of_base(base, settings.remembered, embedder)
    except MemoryUnusable as error:
        _log.warning("planning does without memory: %s", error)
        return None


def _open(
    robot: RobotDescription, shelf: ModelShelf, model: StoredModel, choice: ModelChoice
) -> CommandParser | LocalModel:
    language = model.manifest.language
    if language is not None and language.use is LanguageUse.COMMAND_PARSER:
        # So small a model is done on the CPU before a GPU has begun.
        choice = replace(PLAIN_CHOICE, memory_arena=choice.memory_arena)
        return shelf.load(model, choice, lambda: open_command_parser(model, choice))

    def opened() -> LocalModel:
        language_model = open_language_model(model, choice)
        return LocalModel(model.manifest.name, language_model, robot.name, _shape(robot), checked)

    return shelf.load(model, choice, opened)
