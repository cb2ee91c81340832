"""Define the one canonical plan that every planner emits and the executor runs."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from graphlib import CycleError, TopologicalSorter
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from vla_deploy.plans.catalogue import SkillKind

MOST_ACTIONS: Final = 100
PUT_IN: Final = "put in"
"""What the description of an action says that its author did not ask for."""


Skill = tuple[str, Mapping[str, Any]]
"""The name of a skill, and its parameters."""


PRIORITIES: Final[Mapping[str, int]] = {"high": 1, "medium": 2, "low": 3}
"""What the words for priorities are as numbers; the least number comes first."""


def _number_of(priority: Any) -> Any:
    return PRIORITIES.get(priority, priority) if isinstance(priority, str) else priority


Priority = Annotated[int, BeforeValidator(_number_of)]


class ExecutionOptions(BaseModel):
    """Say how a plan goes on where actions fail, and how long they may take.

    With `continue_on_error` only what depends on a failed action is cancelled. `max_retries` is
    for each action that may be tried again, `timeouts_s` (s) for each kind of skill.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    continue_on_error: bool = False
    max_retries: int = Field(default=1, ge=0, le=10)
    safety_check: Literal[True] = True
    timeouts_s: dict[SkillKind, Annotated[float, Field(gt=0.0, le=3600.0)]] = Field(
        default_factory=dict
    )


class Action(BaseModel):
    """Name one skill with its parameters and what must come before it.

    What it depends on must have succeeded, what it comes `after` must only have ended.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(min_length=1, max_length=64)
    skill: str = Field(min_length=1, max_length=64)
    parameters: dict[str, Any] = Field(default_factory=dict)
    depends_on: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    priority: Priority = PRIORITIES["medium"]
    description: str = ""
    estimated_duration_s: float = Field(default=0.0, ge=0.0)
    feasibility_score: float = Field(default=1.0, ge=0.0, le=1.0)
    resources: tuple[str, ...] = ()
    preconditions: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()

    @property
    def earlier(self) -> tuple[str, ...]:
        """Return the actions that must have ended before this one begins."""
        return (*self.depends_on, *self.after)


class Plan(BaseModel):
    """Answer one command with actions, or say why it is not feasible.

    The planner fills in `keeps_out`: the places that nothing may enter while it is carried out.
    `notes` say what its author wrote in another dialect that is not used as it was written.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    goal: str = Field(min_length=1)
    summary: str = ""
    reasoning: str = ""
    feasible: bool = True
    actions: tuple[Action, ...] = Field(default=(), max_length=MOST_ACTIONS)
    safety_concerns: tuple[str, ...] = ()
    success_criteria: tuple[str, ...] = ()
    keeps_out: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    options: ExecutionOptions = ExecutionOptions()


class FailureCause(StrEnum):
    """Say by what an action failed: the skill itself, or the world before or after it."""

    PRECONDITION = "precondition"
    SKILL = "skill"
    EFFECT = "effect"


def plan_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan, as published in `docs/plan.schema.json`."""
    return Plan.model_json_schema()


def dependency_faults(actions: Sequence[Action]) -> list[str]:
    """Return every duplicate id, unknown dependency and cycle."""
    earlier = [(action.id, action.earlier) for action in actions]
    return order_faults("action", earlier, "in the plan", "the dependencies form a cycle")


def order_faults(
    what: str, earlier: Sequence[tuple[str, Sequence[str]]], where: str, cycle: str
) -> list[str]:
    """Return every duplicate id, unknown dependency and cycle; `earlier` is what each id waits for.

    `what` and `where` name the things and where they should be, `cycle` says that some wait for
    each other.
    """
    ids = [one for one, _ in earlier]
    faults = [f'{what} id "{one}" is used twice' for one in sorted(set(ids)) if ids.count(one) > 1]
    faults += [
        f'{what} "{one}" depends on "{needed}", which is not {where}'
        for one, needs in earlier
        for needed in needs
        if needed not in ids
    ]
    try:
        TopologicalSorter(dict(earlier)).prepare()
    except CycleError as error:
        faults.append(f"{cycle}: " + " -> ".join(reversed(error.args[1])))
    return faults


def execution_order(actions: Sequence[Action]) -> list[Action]:
    """Return actions so that dependencies come first, then priority, then the order given.

    Raises:
        ValueError: the dependencies are not a directed acyclic graph; check them first.
    """
    waiting = list(actions)
    finished: set[str] = set()
    ordered: list[Action] = []
    while waiting:
        ready = [action for action in waiting if finished.issuperset(action.earlier)]
        if not ready:
            raise ValueError("; ".join(dependency_faults(actions)))
        chosen = min(ready, key=lambda action: action.priority)
        waiting.remove(chosen)
        finished.add(chosen.id)
        ordered.append(chosen)
    return ordered


def chained(skills: Sequence[Skill]) -> tuple[Action, ...]:
    """Return the actions of skills, one after the other."""
    return tuple(
        Action(
            id=f"a{number}",
            skill=skill,
            parameters=dict(parameters),
            depends_on=(f"a{number - 1}",) if number > 1 else (),
        )
        for number, (skill, parameters) in enumerate(skills, 1)
    )
