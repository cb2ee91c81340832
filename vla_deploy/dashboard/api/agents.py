"""Show, grant and take back the lease by which AI agents may give commands."""

from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.client.agent_lease import LONGEST_MINUTES, LeaseKeeper
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import Admin, Operator, UserRole, note, require

router = APIRouter(prefix="/agents", tags=["agents"])

_Viewer: Final = Depends(require(UserRole.VIEWER))
_Minutes = Annotated[float, Field(gt=0, le=LONGEST_MINUTES, allow_inf_nan=False)]


class LeaseBody(BaseModel):
    """Say for how long agents may give commands."""

    model_config = ConfigDict(extra="forbid")

    minutes: _Minutes = 10.0


@router.get("/lease", dependencies=[_Viewer])
async def lease(request: Request) -> dict[str, Any]:
    """Return whether agents may give commands, for how long yet, and by whose leave."""
    return _keeper(request).state().document()


@router.post("/lease")
async def grant(body: LeaseBody, request: Request, who: Admin) -> dict[str, Any]:
    """Let agents give commands for some minutes from now on."""
    note(request, minutes=body.minutes)
    return _keeper(request).grant(who.user, body.minutes).document()


@router.post("/revoke")
async def revoke(request: Request, who: Operator) -> dict[str, Any]:
    """Take the lease back: what agents have asked for ends, and the robot comes to rest."""
    return _keeper(request).revoke(who.user).document()


def _keeper(request: Request) -> LeaseKeeper:
    """Return the run's keeper, made at its first use."""
    state = request.app.state
    if not hasattr(state, "agent_lease"):
        link: RobotLink = state.link
        state.agent_lease = LeaseKeeper(link.space, link.clock)
    keeper: LeaseKeeper = state.agent_lease
    return keeper
