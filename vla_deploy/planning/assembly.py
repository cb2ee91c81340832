"""Build the planner that a profile asks for; what is missing is done without, and told."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from drivers.clock import Clock, MonotonicClock
from platforms import Profile
from platforms.profile import PlanningSettings
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.memory import MemoryStore, MemoryUnusable
from vla_deploy.model_servers.errors import ModelServerError
from vla_deploy.model_servers.shelf import ServerShelf
from vla_deploy.one_line import one_line
from vla_deploy.planning.asking import Rung
from vla_deploy.planning.knowledge import spoken_places
from vla_deploy.planning.planner import Planner, checked
from vla_deploy.planning.served.rung import Effort, ServedRung
from vla_deploy.robots import RobotDescription

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
    # Its libraries take a third of a second to load, which a planner of rules can do without.
    from vla_deploy.planning.on_board import open_on_board

    shelf = (
        ModelShelf.of_base(base, clock) if run_dir is None else ModelShelf.of_run(run_dir, clock)
    )
    on_board = open_on_board(robot, profile, shelf, checked, model_tier)
    return open_planner(robot, profile.planning, clock, base, on_board.rungs, on_board.away)


def open_planner(
    robot: RobotDescription,
    settings: PlanningSettings,
    clock: Clock,
    base: Path,
    on_board: Sequence[Rung] = (),
    models_away: Mapping[str, str] | None = None,
) -> Planner:
    """Return a planner for a robot: rules, cache, the models `on_board`, then the servers.

    `base` is the runtime directory, which tells where `servers.toml` lies; `models_away` tells
    which models could not be opened, and why. Nothing is sent yet.
    """
    away: dict[str, str] = dict(models_away or {})
    servers = _served(robot, settings, base, away) if settings.servers else ()
    for name in away.keys() - (models_away or {}).keys():
        _log.warning("planning does without server %s: %s", name, away[name])
    slow = (*on_board, *servers)[: settings.max_rungs]
    return Planner(clock, slow, within_s=settings.within_s, away=away)


def open_memory(settings: PlanningSettings, base: Path) -> MemoryStore | None:
    """Return the robot's memory, None where the profile wants none or its file cannot be used."""
    if settings.remembered == 0:
        return None
    try:
        return MemoryStore.of_base(base, settings.remembered)
    except MemoryUnusable as error:
        _log.warning("planning does without memory: %s", error)
        return None


def _served(
    robot: RobotDescription,
    settings: PlanningSettings,
    base: Path,
    away: dict[str, str],
) -> Iterator[Rung]:
    places = sorted(set(spoken_places(robot.places).values()))
    effort = Effort(candidates=settings.candidates, prompt_characters=settings.prompt_characters)
    for name in settings.servers:
        try:
            # A server answers by the wall clock, whatever time the robot lives by.
            server = ServerShelf.of_base(base, MonotonicClock()).open(name)
        except ModelServerError as error:
            away[name] = one_line(error)
            continue
        yield ServedRung(server, robot.name, places, checked, effort)
