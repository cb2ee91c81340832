"""Answer what is refused, as every error of the API looks."""

from math import ceil

from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse
from starlette.types import Receive, Scope, Send
from starlette.websockets import WebSocket

from vla_deploy.dashboard.access.errors import LoginNeeded, RequestRefused
from vla_deploy.dashboard.access.witness import note_refusal

_DENIAL = "websocket.http.response"
_POLICY_VIOLATION = 1008


def response_of(refusal: RequestRefused) -> JSONResponse:
    """Return the response that tells a refusal."""
    headers = {}
    if refusal.wait_s is not None:
        headers["Retry-After"] = str(ceil(refusal.wait_s))
    if isinstance(refusal, LoginNeeded):
        headers["WWW-Authenticate"] = "Bearer"
    error = {"code": refusal.code, "what": refusal.what, "try": refusal.hint}
    return JSONResponse({"error": error}, refusal.status, headers)


async def refuse(refusal: RequestRefused, scope: Scope, receive: Receive, send: Send) -> None:
    """Answer a request, or deny the opening of a WebSocket."""
    note_refusal(scope, refusal.code)
    if scope["type"] == "websocket":
        await _deny(refusal, WebSocket(scope, receive, send))
    else:
        await response_of(refusal)(scope, receive, send)


async def answer(connection: HTTPConnection, refusal: Exception) -> JSONResponse:
    """Return the response to a refusal that a route raised; a WebSocket is denied here."""
    assert isinstance(refusal, RequestRefused)
    note_refusal(connection.scope, refusal.code)
    if isinstance(connection, WebSocket):
        await _deny(refusal, connection)
    return response_of(refusal)


async def _deny(refusal: RequestRefused, websocket: WebSocket) -> None:
    if _DENIAL in websocket.scope.get("extensions", {}):
        await websocket.send_denial_response(response_of(refusal))
    else:
        await websocket.close(_POLICY_VIOLATION, refusal.what)
