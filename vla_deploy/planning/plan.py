"""Define the one canonical plan that every planner emits and the executor runs."""

from enum import StrEnum
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field

MOST_ACTIONS: Final = 100
PUT_IN: Final = "put in"
"""What the description of an action says that its author did not ask for."""


class Priority(StrEnum):
    """Rank actions whose dependencies allow either order."""

    HIGH = "high"
    MEDIUM = "medium"
    LOW = "low"


class Action(BaseModel):
    """Name one skill with its parameters and what must come before it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: str = Field(min_length=1, max_length=64)
    skill: str = Field(min_length=1, max_length=64)
    parameters: dict[str, Any] = Field(default_factory=dict)
    depends_on: tuple[str, ...] = ()
    priority: Priority = Priority.MEDIUM
    description: str = ""
    estimated_duration_s: float = Field(default=0.0, ge=0.0)
    feasibility_score: float = Field(default=1.0, ge=0.0, le=1.0)
    resources: tuple[str, ...] = ()
    preconditions: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()


class Plan(BaseModel):
    """Answer one command with actions, or say why it is not feasible.

    The planner fills in `keeps_out`: the places that nothing may enter while it is carried out.
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


def plan_schema() -> dict[str, Any]:
    """Return the JSON Schema of a plan, as published in `docs/plan.schema.json`."""
    return Plan.model_json_schema()
