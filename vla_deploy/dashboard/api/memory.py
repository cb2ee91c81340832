"""Show what the robot remembers of its commands, and correct what came of one.

The file is opened for each request: the planner's process writes it all the while.
"""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from http import HTTPStatus
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Path, Query, Request
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.memory import EpisodeOutcome, MemoryStore, MemoryUnusable
from vla_deploy.memory.errors import NoSuchEpisode
from vla_deploy.memory.judgement import MOST_CHARACTERS

router = APIRouter(prefix="/memory", tags=["memory"])

MOST_EPISODES: Final = 200
# What people said to the robot is not for everybody who may look at it.
_Operator: Final = Depends(require(UserRole.OPERATOR))


class OutcomeBody(BaseModel):
    """Hold what really came of a command, and why it was taken for something else."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"outcome": "failed", "why": "it was the wrong cup"}]},
    )

    outcome: Literal["succeeded", "failed"]
    why: str = Field(default="", max_length=MOST_CHARACTERS)


@router.get("/episodes", dependencies=[_Operator])
def episodes(
    request: Request,
    like: Annotated[str, Query(max_length=500, description="only what is like these words")] = "",
    limit: Annotated[int, Query(ge=1, le=MOST_EPISODES)] = 20,
) -> list[dict[str, Any]]:
    """Return the commands that are remembered: the newest, or those that fit some words best."""
    with _store(request) as store:
        if not like:
            return [one.document() for one in store.newest(limit)]
        return [one.episode.document() for one in store.recall(like, limit)]


@router.post("/episodes/{number}/outcome", dependencies=[_Operator])
def correct(
    number: Annotated[int, Path(ge=1)], body: OutcomeBody, request: Request
) -> dict[str, Any]:
    """Correct what came of a command; what the robot took it for stays known beside it."""
    note(request, episode=number, outcome=body.outcome)
    with _store(request) as store:
        return store.update_outcome(number, EpisodeOutcome(body.outcome), body.why).document()


@contextmanager
def _store(request: Request) -> Iterator[MemoryStore]:
    link: RobotLink = request.app.state.link
    try:
        with closing(MemoryStore.of_base(link.base)) as store:
            yield store
    except NoSuchEpisode as error:
        raise ApiError(
            HTTPStatus.NOT_FOUND, "no_such_episode", str(error), "see GET /api/v1/memory/episodes"
        ) from error
    except MemoryUnusable as error:
        raise ApiError(
            HTTPStatus.SERVICE_UNAVAILABLE, "no_memory", str(error), "vla-deploy doctor"
        ) from error
