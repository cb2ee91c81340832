"""Let a page pause, wind and hasten the replay that it shows."""

from http import HTTPStatus
from typing import Annotated, Any, Final, Literal

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError

router = APIRouter(tags=["replay"])

_STATUS_AGE_S: Final = 3.0
_LONGEST_S: Final = 1e9


class ReplayAct(BaseModel):
    """Say what the replay is to do; `value` is a moment in seconds for seek, a factor for speed."""

    model_config = ConfigDict(extra="forbid")

    act: Literal["pause", "resume", "seek", "speed"]
    value: Annotated[float, Field(ge=0, le=_LONGEST_S)] = 0.0


class Asked(BaseModel):
    """Say that the replay was asked; the topic `replay_status` tells what it does, or refuses."""

    asked: bool = True


@router.post("/replay", dependencies=[Depends(require(UserRole.OPERATOR))])
def replay(request: Request, asked: ReplayAct) -> Asked:
    """Ask the replay; 409 where a robot runs."""
    link: Any = request.app.state.link
    if link.document("replay_status", _STATUS_AGE_S) is None:
        raise ApiError(
            HTTPStatus.CONFLICT,
            "no_replay",
            "nothing is replayed here",
            "begin one: vla-deploy replay FILE",
        )
    link.publish("replay_request", asked.model_dump())
    return Asked()
