"""Read the corpora: commands with their scenes and goals, other talk, and attacks."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from benchmarks.planner_flat import FlatHome, FlatThing, load_home, thing_of
from benchmarks.planner_goals import Goal, parse_goal
from benchmarks.planner_world import FlatWorld

CORPORA: Final = Path(__file__).parent / "corpora"
JUDGING: Final = "judging"
COMMAND_CORPORA: Final = (JUDGING, "development", "kept")
"""What the planner is judged by, what whoever works on it may read, and what is kept aside."""
PLAN, ASK, REFUSE, STOP = "plan", "ask", "refuse", "stop"
MUSTS: Final = (PLAN, ASK, REFUSE, STOP)
_ID: Final = re.compile(r"[a-z]+_\d+")


class CorpusUnreadable(Exception):
    """Say which line of the corpora is wrong."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CorpusTurn:
    """Hold what is said, or the plan that is handed in, and what must come of it.

    `must` lists the outcomes that are right. `goal` is what a plan must reach; in an attack it is
    the only thing that a plan may reach.
    """

    say: str
    plan: Any = None
    must: tuple[str, ...] = (PLAN,)
    goal: Goal | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """Hold one conversation in one scene."""

    name: str
    kind: str
    scene: str
    turns: tuple[CorpusTurn, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CorpusScene:
    """Hold where the robot stands, in the map, and what is in the flat."""

    robot: tuple[float, float, float]
    things: tuple[FlatThing, ...]

    def world(self, home: FlatHome) -> FlatWorld:
        """Return this scene as a world to carry plans out in."""
        return FlatWorld(
            home=home, pose=self.robot, things={one.thing_id: one for one in self.things}
        )


@cache
def home() -> FlatHome:
    """Return the flat."""
    return load_home()


@cache
def scenes() -> Mapping[str, CorpusScene]:
    """Return every scene by its name."""
    text = (CORPORA / "scenes.toml").read_text(encoding="utf-8")
    return MappingProxyType({name: _scene(told) for name, told in tomllib.loads(text).items()})


def command_kinds(corpus: str = JUDGING) -> list[str]:
    """Return the kinds of commands of a corpus: a file each."""
    return sorted(path.stem for path in (CORPORA / corpus).glob("*.jsonl"))


def commands(kinds: Sequence[str] = (), corpus: str = JUDGING) -> list[Case]:
    """Return the commands of some kinds, of all by default."""
    return [
        case
        for kind in kinds or command_kinds(corpus)
        for case in _cases(CORPORA / corpus / f"{kind}.jsonl", (PLAN,))
    ]


def attacks(kinds: Sequence[str] = ()) -> list[Case]:
    """Return the attacks of some kinds, of all by default; a goal is all that one may end in."""
    paths = sorted((CORPORA / "adversarial").glob("*.jsonl"))
    wanted = [path for path in paths if not kinds or path.stem in kinds]
    return [case for path in wanted for case in _cases(path, (ASK, REFUSE))]


def other_talk() -> list[str]:
    """Return sentences that are no commands to this robot."""
    text = (CORPORA / "off_domain.txt").read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _cases(path: Path, must: tuple[str, ...]) -> Iterator[Case]:
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            yield _case(json.loads(line), f"{path.stem}-{number}", path.stem, must)
        except (ValueError, KeyError, CorpusUnreadable) as error:
            raise CorpusUnreadable(f"{path.name}, line {number}: {error!r}") from error


def _case(told: Mapping[str, Any], name: str, kind: str, must: tuple[str, ...]) -> Case:
    scene = str(told.get("scene", "tidy"))
    if scene not in scenes():
        raise CorpusUnreadable(f'scene "{scene}" is not in scenes.toml')
    turns = tuple(_turn(one, must) for one in told.get("turns", [told]))
    for turn in turns:
        _check_names(turn, scene)
    return Case(name=name, kind=kind, scene=scene, turns=turns)


def _turn(told: Mapping[str, Any], default: tuple[str, ...]) -> CorpusTurn:
    goal = parse_goal(str(told["goal"])) if "goal" in told else None
    must = tuple(str(told["must"]).split("|")) if "must" in told else default
    if goal is not None and PLAN not in must:
        must = (*must, PLAN)
    if not set(must) <= set(MUSTS) or (PLAN in must and goal is None):
        raise CorpusUnreadable(f"a turn must {must}; of {MUSTS}, and a plan needs a goal")
    return CorpusTurn(say=str(told.get("say", "")), plan=told.get("plan"), must=must, goal=goal)


def _check_names(turn: CorpusTurn, scene: str) -> None:
    known = {one.thing_id for one in scenes()[scene].things}
    for way in turn.goal.ways if turn.goal else ():
        for condition in way:
            wrong = [word for word in condition[1:] if _ID.fullmatch(word) and word not in known]
            if condition[0] != "said" and wrong:
                raise CorpusUnreadable(f"{wrong} is not in the scene {scene}")


def _scene(told: Mapping[str, Any]) -> CorpusScene:
    robot = told["robot"]
    if isinstance(robot, str):
        pose = home().places[robot]
    else:
        x_m, y_m, yaw_rad = map(float, robot)
        pose = (x_m, y_m, yaw_rad)
    return CorpusScene(robot=pose, things=tuple(thing_of(one) for one in told["things"]))
