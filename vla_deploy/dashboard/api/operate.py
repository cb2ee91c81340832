"""Stop the robot, which anyone may; reset, arm and disarm it, and wait for control to show it."""

import asyncio
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Request
from pydantic import BaseModel, ConfigDict, Field

from drivers.clock import NS_PER_S
from vla_deploy.client.acts import REACHED, Status, why_not
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import UserRole, note, require
from vla_deploy.dashboard.access.connections import PRESSED
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.ipc.stop_button import ESTOP

router = APIRouter(tags=["operate"])
_WITHIN_S: Final = 3.0
_Operator: Final = Depends(require(UserRole.OPERATOR))


async def carried_out(link: RobotLink, act: str, within_s: float) -> tuple[bool, Status | None]:
    """Wait until control's status shows an act; return whether it did in time, and the status."""
    end_ns = link.clock.now_ns() + round(within_s * NS_PER_S)
    while True:
        status = link.document(topics.CONTROL_STATUS, age_limit_s=1.0)
        if status is not None and REACHED[act](status):
            return True, status
        if link.clock.now_ns() >= end_ns:
            return False, status
        await asyncio.sleep(0.02)


class ReasonBody(BaseModel):
    """Hold the reason of an act, for the log."""

    model_config = ConfigDict(extra="forbid")

    reason: Annotated[str, Field(max_length=150)] = ""


class StopPressed(BaseModel):
    """Confirm that the stop was pressed."""

    pressed: bool = True


@router.post("/stop", dependencies=[Depends(require(UserRole.ANYONE))])
async def stop(request: Request, why: ReasonBody | None = None) -> StopPressed:
    """Press the software stop, which latches; it needs no login, and no body."""
    reason = why.reason if why else ""
    if not getattr(request.state, PRESSED, False):
        request.app.state.link.operate(ESTOP, reason)
    note(request, reason=reason)
    return StopPressed()


@router.post("/reset", dependencies=[_Operator])
async def reset(request: Request, why: ReasonBody | None = None) -> dict[str, Any]:
    """Release a latched stop; nothing moves, arming is a separate act."""
    return await _act(request, "reset", why)


@router.post("/arm", dependencies=[_Operator])
async def arm(request: Request, why: ReasonBody | None = None) -> dict[str, Any]:
    """Power the joints at their positions, so that commands may move them."""
    return await _act(request, "arm", why)


@router.post("/disarm", dependencies=[_Operator])
async def disarm(request: Request, why: ReasonBody | None = None) -> dict[str, Any]:
    """Remove power from the joints: a raised arm sinks."""
    return await _act(request, "disarm", why)


async def _act(request: Request, act: OperatorActName, why: ReasonBody | None) -> dict[str, Any]:
    link: RobotLink = request.app.state.link
    reason = why.reason if why else ""
    link.operate(act, reason)
    note(request, reason=reason)
    is_done, status = await carried_out(link, act, _WITHIN_S)
    if not is_done:
        raise ApiError(HTTPStatus.CONFLICT, f"no_{act}", why_not(status), "see the robot's state")
    return {"act": act, "control": status}
