"""List the alarms, and take note of who has seen one."""

from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Request

from vla_deploy.dashboard.access import Operator, UserRole, require
from vla_deploy.dashboard.errors import ApiError

router = APIRouter(tags=["alarms"])

_AlarmId = Annotated[str, Path(pattern=r"^[0-9]{1,12}$")]
_WHERE: Final = "see GET /api/v1/alarms; the oldest that have ended are forgotten"


@router.get("/alarms", dependencies=[Depends(require(UserRole.VIEWER))])
async def alarms(request: Request) -> dict[str, list[dict[str, Any]]]:
    """Return the alarms that last and those that have ended, the newest first."""
    told: dict[str, list[dict[str, Any]]] = request.app.state.alarms.document()
    return told


@router.post("/alarms/{alarm_id}/acknowledge")
async def acknowledge(alarm_id: _AlarmId, request: Request, who: Operator) -> dict[str, Any]:
    """Note that the alarm was seen; it lasts until its condition has gone.

    Raises:
        ApiError: there is no such alarm.
    """
    alarm = request.app.state.alarms.acknowledge(alarm_id, who.user)
    if alarm is None:
        raise ApiError(HTTPStatus.NOT_FOUND, "no_alarm", f"no alarm {alarm_id}", _WHERE)
    document: dict[str, Any] = alarm.document()
    return document
