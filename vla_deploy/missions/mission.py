"""Define what a mission is, and read one from words or from a document of any dialect."""

import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from vla_deploy.missions.criteria import read_criterion
from vla_deploy.missions.errors import MissionInvalid
from vla_deploy.missions.schedule import MissionSchedule, check_schedule, split_schedule
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import PRIORITIES, Action, Priority, order_faults

MOST_OBJECTIVES: Final = 50
MOST_SUBTASKS: Final = 200
MOST_CHARACTERS: Final = 1000
# What other systems call parts of the robot.
RESOURCES: Final[Mapping[str, str]] = {
    "navigation_system": "base", "navigation": "base", "base": "base", "head": "head",
    "camera": "camera", "microphone": "microphone", "speaker": "speaker", "voice": "speaker",
}  # fmt: skip
_SEPARATOR: Final = re.compile(r"\s*;\s*(?:and )?(?:then )?", re.I)
_MEANWHILE: Final = re.compile(r"(?:meanwhile|at the same time),? ?", re.I)
_ALIASES: Final[Mapping[str, tuple[str, ...]]] = {
    "words": ("words", "command", "text", "description", "name", "objective", "goal"),
    "depends_on": ("depends_on", "dependencies"),
    "resources": ("resources", "required_resources"),
    "success_criteria": ("success_criteria", "criteria"),
    "estimated_duration_s": ("estimated_duration_s", "estimated_duration", "duration"),
    "subtasks": ("subtasks", "tasks"),
    "id": ("id", "task_id"),
    "priority": ("priority",),
    "actions": ("actions",),
}
_ALL_KEYS: Final = {one for names in _ALIASES.values() for one in names} | {"type", "status"}

Json = dict[str, Any]


class _Part(BaseModel):
    """Hold what objectives and subtasks have in common; the least priority comes first."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(min_length=1, max_length=48, pattern=r"^[A-Za-z0-9_-]+$")
    depends_on: tuple[str, ...] = ()
    priority: Priority = PRIORITIES["medium"]
    success_criteria: tuple[str, ...] = ()


class Subtask(_Part):
    """Do one thing: a command in words, or actions of the canonical plan."""

    words: str = Field(default="", max_length=MOST_CHARACTERS)
    actions: tuple[Action, ...] = ()
    resources: tuple[str, ...] = ()
    estimated_duration_s: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)


class Objective(_Part):
    """Reach one thing by subtasks."""

    words: str = Field(default="", max_length=MOST_CHARACTERS)
    subtasks: tuple[Subtask, ...] = Field(min_length=1)


class Mission(BaseModel):
    """Reach several objectives, in the order of their dependencies, then of their priority."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    goal: str = Field(min_length=1, max_length=MOST_CHARACTERS)
    objectives: tuple[Objective, ...] = Field(min_length=1, max_length=MOST_OBJECTIVES)
    schedule: MissionSchedule = MissionSchedule()


def mission_from_words(text: str, now: datetime) -> Mission | None:
    """Return the mission that words ask for, None for a plain command.

    Objectives are set apart by ";" and done one after the other; what begins by "meanwhile" is
    done beside the one before it. A time or a condition at the beginning or the end makes a mission
    of one command, too.

    Raises:
        MissionInvalid: the time is none, or the condition cannot be checked.
    """
    try:
        return _of_words(text, now)
    except ValidationError as error:
        raise MissionInvalid(_faults_of(error)) from error


def _of_words(text: str, now: datetime) -> Mission | None:
    rest, schedule = split_schedule(text, now)
    parts = [one.strip(" .") for one in _SEPARATOR.split(rest) if one.strip(" .")]
    if len(parts) < 2 and schedule.is_at_once:
        return None
    objectives: list[Objective] = []
    before: tuple[str, ...] = ()
    group: list[str] = []
    for number, said in enumerate(parts, 1):
        beside = _MEANWHILE.match(said)
        if beside is None:
            before, group = tuple(group), []
        name = f"o{number}"
        group.append(name)
        words = said[beside.end() :] if beside else said
        subtask = Subtask(id="s1", words=words)
        objectives.append(Objective(id=name, words=words, depends_on=before, subtasks=(subtask,)))
    if not objectives:
        raise MissionInvalid(["it says when, but not what"])
    return Mission(goal=text, objectives=tuple(objectives), schedule=schedule)


def read_mission(document: Any) -> Mission:
    """Read a mission from a document: a list of objectives, or an object with `objectives`.

    An objective is a command in words, an object with subtasks, or one with the keys of a subtask.

    Raises:
        MissionInvalid: carries every fault.
    """
    if isinstance(document, list):
        document = {"objectives": document}
    if not isinstance(document, Mapping):
        raise MissionInvalid([f"expected a JSON object or a list, got {document!r:.60}"])
    listed = document.get("objectives", document.get("tasks"))
    if isinstance(listed, Mapping):
        listed = list(listed.values())
    if not isinstance(listed, list):
        raise MissionInvalid(['expected "objectives", a list of commands or of objects'])
    canonical = {
        "goal": document.get("goal") or document.get("name") or "mission",
        "objectives": [_objective(one, number) for number, one in enumerate(listed, 1)],
        "schedule": document.get("schedule") or {},
    }
    try:
        return Mission.model_validate(canonical)
    except ValidationError as error:
        raise MissionInvalid(_faults_of(error)) from error


def _faults_of(error: ValidationError) -> list[str]:
    return [f"{'.'.join(map(str, one['loc']))}: {one['msg']}" for one in error.errors()]


def _objective(given: Any, number: int) -> Json:
    name = f"o{number}"
    if isinstance(given, str):
        return {"id": name, "words": given, "subtasks": [{"id": "s1", "words": given}]}
    found = _known(given, f"objective {number}")
    subtasks = found.pop("subtasks", None)
    found.setdefault("id", name)
    if subtasks is None:
        own = {key: found.pop(key) for key in tuple(found) if key not in _Part.model_fields}
        found["words"] = own.get("words", "")
        subtasks = [{"id": "s1", **own}]
    if isinstance(subtasks, Mapping):
        subtasks = list(subtasks.values())
    if not isinstance(subtasks, list):
        raise MissionInvalid([f"objective {number}: subtasks must be a list"])
    found["subtasks"] = [
        {"id": f"s{place}"}
        | (
            {"words": one}
            if isinstance(one, str)
            else _known(one, f"{found['id']}, subtask {place}")
        )
        for place, one in enumerate(subtasks, 1)
    ]
    return found


def _known(given: Any, where: str) -> Json:
    if not isinstance(given, Mapping):
        raise MissionInvalid([f"{where} is no JSON object: {given!r:.60}"])
    unknown = sorted(set(given) - _ALL_KEYS)
    if unknown:
        raise MissionInvalid([f"{where} has unknown keys: {', '.join(unknown)}"])
    found = {
        key: next(given[name] for name in names if name in given)
        for key, names in _ALIASES.items()
        if any(name in given for name in names)
    }
    if isinstance(found.get("success_criteria"), str):
        found["success_criteria"] = [found["success_criteria"]]
    return found


def check_mission(mission: Mission, world: World, parts: Sequence[str], now_unix_s: float) -> None:
    """Accept a mission, or name everything that is wrong with it.

    `parts` are those of the robot that actions claim.

    Raises:
        MissionInvalid: carries all faults.
    """
    faults = _order_faults("objective", mission.objectives)
    if sum(len(one.subtasks) for one in mission.objectives) > MOST_SUBTASKS:
        faults.append(f"it has more than {MOST_SUBTASKS} subtasks")
    for objective in mission.objectives:
        faults += _order_faults(f"objective {objective.id}: subtask", objective.subtasks)
        faults += _criteria_faults(objective.id, objective.success_criteria, world)
        for subtask in objective.subtasks:
            faults += _subtask_faults(f"{objective.id}.{subtask.id}", subtask, world, parts)
    faults += _criteria_faults("schedule", [one for one in (mission.schedule.when,) if one], world)
    try:
        check_schedule(mission.schedule, now_unix_s)
    except MissionInvalid as error:
        faults += error.faults
    if faults:
        raise MissionInvalid(faults)


def _subtask_faults(name: str, subtask: Subtask, world: World, parts: Sequence[str]) -> list[str]:
    faults = _criteria_faults(name, subtask.success_criteria, world)
    if bool(subtask.words.strip()) == bool(subtask.actions):
        faults.append(f"{name}: expected either words or actions")
    known = {*parts, "microphone"}
    faults += [
        f'{name} needs "{one}", which this robot does not have; it has: {", ".join(sorted(known))}'
        for one in subtask.resources
        if RESOURCES.get(one, one) not in known
    ]
    return faults


def _criteria_faults(name: str, criteria: Sequence[str], world: World) -> list[str]:
    faults = []
    for text in criteria:
        try:
            read_criterion(text, world)
        except MissionInvalid as error:
            faults += [f"{name}: {fault}" for fault in error.faults]
    return faults


def _order_faults(what: str, parts: Sequence[_Part]) -> list[str]:
    earlier = [(one.id, one.depends_on) for one in parts]
    return order_faults(what, earlier, "there", f"{what}s wait for each other")
