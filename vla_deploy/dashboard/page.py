"""Serve the page: plain files that ask no other host for anything, and may run no other script."""

from pathlib import Path
from typing import Any, Final

from fastapi import APIRouter, Depends, FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse
from fastapi.staticfiles import StaticFiles
from starlette.responses import Response

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.stop_address import stop_door_url

STATIC: Final = Path(__file__).with_name("static")
_STOP_META: Final = 'name="stop-door" content=""'

router = APIRouter(include_in_schema=False, dependencies=[Depends(require(UserRole.ANYONE))])


class _PageFiles(StaticFiles):
    """Serve files of which a browser asks each time whether they have changed."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        response = super().file_response(*args, **kwargs)
        response.headers["cache-control"] = "no-cache"
        return response


def add_page_files(app: FastAPI) -> None:
    """Serve what the page is made of below `/static`."""
    app.mount("/static", _PageFiles(directory=STATIC, check_dir=False))


@router.get("/")
async def index(request: Request) -> HTMLResponse:
    """Return the page, which knows by a meta element where the stop door is."""
    text = (STATIC / "index.html").read_text(encoding="utf-8")
    meta = f'name="stop-door" content="{stop_door_url(request)}"'
    return HTMLResponse(text.replace(_STOP_META, meta), headers={"cache-control": "no-store"})


@router.get("/favicon.ico")
async def favicon() -> FileResponse:
    """Return the page's icon for browsers that ask by this name."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml")
