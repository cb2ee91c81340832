"""List and hand out what the flight recorder has saved; names lead to nothing else."""

import contextlib
from collections.abc import Iterable
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

from fastapi import APIRouter, Depends, Request
from fastapi.responses import FileResponse

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.telemetry.folder import FlightFolder, folder_of

router = APIRouter(tags=["recordings"], dependencies=[Depends(require(UserRole.VIEWER))])

MCAP: Final = "application/octet-stream"


@router.get("/flights")
def flights(request: Request) -> list[dict[str, Any]]:
    """Return the saved flights, the newest first."""
    return described(reversed(_flights(request)))


@router.get("/flights/{name}", response_class=FileResponse)
def flight(name: str, request: Request) -> FileResponse:
    """Return a flight's MCAP file."""
    return handed_out(name, _flights(request), "see GET /api/v1/flights")


def described(paths: Iterable[Path]) -> list[dict[str, Any]]:
    """Return what a list says of files; `saved_s` is in Unix seconds.

    One that has made room for a newer one meanwhile is left out.
    """
    told = []
    for path in paths:
        with contextlib.suppress(FileNotFoundError):
            found = path.stat()
            saved_s = round(found.st_mtime, 3)
            told.append({"name": path.name, "bytes": found.st_size, "saved_s": saved_s})
    return told


def handed_out(name: str, known: Iterable[Path], where: str) -> FileResponse:
    """Return the file of that name among the known ones: a name is compared, never followed.

    Raises:
        ApiError: there is none.
    """
    for path in known:
        if path.name == name and path.is_file() and not path.is_symlink():
            return FileResponse(path, filename=path.name, media_type=MCAP)
    raise ApiError(HTTPStatus.NOT_FOUND, "no_such_file", f"no file {name!r:.120}", where)


def _flights(request: Request) -> list[Path]:
    return FlightFolder(folder_of(request.app.state.link.base)).flights()
