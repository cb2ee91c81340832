"""Define the verdict on a goal or an action, as each analysis of a scene carries it."""

from enum import StrEnum
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Ratio = Annotated[float, Field(ge=0.0, le=1.0)]


class Feasible(StrEnum):
    """Say whether a goal can be reached."""

    YES = "yes"
    AFTER_PREREQUISITES = "after_prerequisites"
    NO = "no"
    UNKNOWN = "unknown"


class Task(BaseModel):
    """Judge a goal: `confidence` says how sure the verdict is, 0 for an unknown one.

    `prerequisites` must be done before, `obstacles` are in the way, `alternatives` could be done
    instead.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    goal: str
    feasible: Feasible
    confidence: Ratio
    reason: str
    prerequisites: tuple[str, ...] = ()
    obstacles: tuple[str, ...] = ()
    alternatives: tuple[str, ...] = ()
