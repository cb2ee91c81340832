"""Serve the page: plain files that may connect to the dashboard and the stop door only."""

import re
from pathlib import Path
from typing import Any, Final

from fastapi import APIRouter, Depends, FastAPI, Request
from fastapi.responses import FileResponse, HTMLResponse
from fastapi.staticfiles import StaticFiles
from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.ipc import topics

_HOST: Final = re.compile(r"(\[[0-9a-fA-F:.]+\]|[A-Za-z0-9._-]+)(:\d{1,5})?")
_POLICY: Final = {
    "default-src": "'none'",
    "script-src": "'self'",
    "style-src": "'self'",
    "img-src": "'self' data: blob:",
    "font-src": "'self'",
    "media-src": "'self' blob:",
    "worker-src": "'self'",
    "manifest-src": "'self'",
    "connect-src": "'self' {stop_door}",
    "form-action": "'self' {stop_door}",
    "base-uri": "'none'",
    "frame-ancestors": "'none'",
}
_HEADERS: Final = {
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=(self)",
}
STATIC: Final = Path(__file__).with_name("static")
_STOP_META: Final = 'name="stop-door" content=""'
router = APIRouter(include_in_schema=False, dependencies=[Depends(require(UserRole.ANYONE))])


def stop_door_url(request: HTTPConnection) -> str:
    """Return the stop door's address by the host name that the request used.

    The port is the one that the door published last, else that of the settings.
    """
    state = request.app.state
    status = state.link.document(topics.STOP_DOOR_STATUS) or {}
    port = status.get("port", state.settings.stop_port)
    return f"{state.settings.scheme}://{called_host(request) or state.settings.host}:{port}"


def called_host(request: HTTPConnection) -> str:
    """Return the name of the Host header without the port, "" when it is malformed."""
    found = _HOST.fullmatch(request.headers.get("host", ""))
    return found[1] if found else ""


class SafeHeaders:
    """Add the headers to every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in (_HEADERS | policy(scope)).items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_with_headers)


def policy(scope: Any) -> dict[str, str]:
    """Return the content security policy's header for a request."""
    stop_door = stop_door_url(HTTPConnection(scope))
    words = "; ".join(f"{name} {sources}" for name, sources in _POLICY.items())
    return {"content-security-policy": words.format(stop_door=stop_door)}


class _PageFiles(StaticFiles):
    """Serve files that a browser revalidates each time."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        response = super().file_response(*args, **kwargs)
        response.headers["cache-control"] = "no-cache"
        return response


def add_page_files(app: FastAPI) -> None:
    """Serve the page's files below `/static`."""
    app.mount("/static", _PageFiles(directory=STATIC, check_dir=False))


@router.get("/")
async def index(request: Request) -> HTMLResponse:
    """Return the page, with the stop door's address in a meta element."""
    text = (STATIC / "index.html").read_text(encoding="utf-8")
    meta = f'name="stop-door" content="{stop_door_url(request)}"'
    return HTMLResponse(text.replace(_STOP_META, meta), headers={"cache-control": "no-store"})


@router.get("/favicon.ico")
async def favicon() -> FileResponse:
    """Return the page's icon under its conventional name."""
    return FileResponse(STATIC / "icon.svg", media_type="image/svg+xml")
