"""Show what the processes of this run have logged, the newest first."""

import logging
from enum import StrEnum
from http import HTTPStatus
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Query, Request

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.supervisor.log_files import newest_lines, processes_in

router = APIRouter(tags=["logs"], dependencies=[Depends(require(UserRole.VIEWER))])

MOST_LINES: Final = 1000


class Level(StrEnum):
    """Name the least level to show."""

    DEBUG = "debug"
    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@router.get("/logs")
def logs(
    request: Request,
    process: Annotated[str, Query(max_length=64)] = "",
    level: Level = Level.INFO,
    limit: Annotated[int, Query(ge=1, le=MOST_LINES)] = 200,
    before: Annotated[int | None, Query(ge=0, lt=2**63, description="stamp_ns")] = None,
) -> dict[str, Any]:
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
    least = logging.getLevelNamesMapping()[level.upper()]
    chosen = [process] if process else names
    lines = [line for name in chosen for line in newest_lines(folder, name, limit, least, before)]
    newest = sorted(lines, key=lambda line: int(line["stamp_ns"]), reverse=True)[:limit]
    return {"processes": names, "lines": newest}
