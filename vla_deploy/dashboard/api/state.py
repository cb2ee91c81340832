"""Answer how the robot is: state, alarms, log lines, and the health of the dashboard."""

import logging
from datetime import UTC, datetime
from enum import StrEnum
from http import HTTPStatus
from importlib.metadata import version
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Path, Query, Request
from fastapi.responses import JSONResponse

from vla_deploy.dashboard.access import Operator, UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.supervisor.runs.log_files import newest_lines, processes_in
from vla_deploy.telemetry.robot_state import collect

router = APIRouter()
health = APIRouter(tags=["state"])

MOST_LINES: Final = 1000
_VIEWER: Final = [Depends(require(UserRole.VIEWER))]
_ALARMS_HINT: Final = "see GET /api/v1/alarms; the oldest that have ended are forgotten"
_AlarmId = Annotated[str, Path(pattern=r"^[0-9]{1,12}$")]


class LogLevel(StrEnum):
    """Name the lowest level to show."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@router.get("/state", tags=["state"], dependencies=_VIEWER)
async def get_state(request: Request) -> dict[str, Any]:
    """Return the status of every process, null where one is silent."""
    return {
        **collect(request.app.state.link),
        "version": version("vla-deploy"),
        "wall_time": datetime.now(UTC).isoformat(timespec="milliseconds"),
    }


@health.get("/healthz", dependencies=[Depends(require(UserRole.ANYONE))])
async def get_health() -> dict[str, bool]:
    """Return that the dashboard answers, and nothing about the robot."""
    return {"answers": True}


@router.get("/logs", tags=["logs"], dependencies=_VIEWER, response_model=dict[str, Any])
def logs(
    request: Request,
    process: Annotated[str, Query(max_length=64)] = "",
    level: LogLevel = LogLevel.INFO,
    limit: Annotated[int, Query(ge=1, le=MOST_LINES)] = 200,
    before: Annotated[int | None, Query(ge=0, lt=2**63, description="stamp_ns")] = None,
) -> JSONResponse:
    """Return the newest lines, older than `before`; of one process, or of all by time.

    Raises:
        ApiError: no process of that name has logged.
    """
    folder = request.app.state.link.run_dir / LOGS_DIR
    names = processes_in(folder)
    if process and process not in names:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_process",
            f"no log of {process!r}; there are {', '.join(names)}",
            "choose one of them, or none for all",
        )
    lowest = logging.getLevelNamesMapping()[level.upper()]
    chosen = [process] if process else names
    lines = [line for name in chosen for line in newest_lines(folder, name, limit, lowest, before)]
    newest = sorted(lines, key=lambda line: int(line["stamp_ns"]), reverse=True)[:limit]
    # Written here, in a thread: the event loop belongs to the stop.
    return JSONResponse({"processes": names, "lines": newest})


@router.get("/alarms", tags=["alarms"], dependencies=_VIEWER)
async def alarms(request: Request) -> dict[str, list[dict[str, Any]]]:
    """Return open and ended alarms, the newest first."""
    document: dict[str, list[dict[str, Any]]] = request.app.state.alarms.document()
    return document


@router.post("/alarms/{alarm_id}/acknowledge", tags=["alarms"])
async def acknowledge(alarm_id: _AlarmId, request: Request, who: Operator) -> dict[str, Any]:
    """Acknowledge an alarm, which stays open until its condition ends.

    Raises:
        ApiError: there is no such alarm.
    """
    alarm = request.app.state.alarms.acknowledge(alarm_id, who.user)
    if alarm is None:
        raise ApiError(HTTPStatus.NOT_FOUND, "no_alarm", f"no alarm {alarm_id}", _ALARMS_HINT)
    document: dict[str, Any] = alarm.document()
    return document
