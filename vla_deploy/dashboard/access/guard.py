"""Check every request before its route: the user, the body, and the role that it needs."""

from typing import Annotated, Final

from fastapi import Depends, FastAPI
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from vla_deploy.client.access.accounts import UserRole
from vla_deploy.dashboard.access.access_control import AccessControl
from vla_deploy.dashboard.access.audit_middleware import AuditMiddleware, note_code, note_required
from vla_deploy.dashboard.access.body import read_body, read_stop_body, replay
from vla_deploy.dashboard.access.identity import IDENTITY, Identity, unknown_user
from vla_deploy.dashboard.access.read_turns import ReadTurns
from vla_deploy.dashboard.access.request import WEBSOCKET, IncomingRequest, read_request
from vla_deploy.dashboard.errors import AccessDenied, Denial, denial_response

_DENIAL_EXTENSION: Final = "websocket.http.response"
_POLICY_VIOLATION: Final = 1008
_OF_BODY: Final = (b"content-type", b"content-length")


class AccessGuard:
    """Pass on the requests that are admitted, with the identity in `request.state.identity`."""

    def __init__(self, app: ASGIApp, access: AccessControl) -> None:
        self._app = app
        self._access = access
        self._reads = ReadTurns()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request or WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = read_request(scope)
        scope.setdefault("state", {})[IDENTITY] = unknown_user(request.peer.address)
        audited = AuditMiddleware(scope, request, send, self._access.audit)
        try:
            receive = await self._admit(scope, receive, request)
        except AccessDenied as denied:
            await _deny(denied, scope, receive, audited.send)
            return
        with audited:
            if request.method == WEBSOCKET:
                session = self._access.session_expiry(request, receive, audited.send)
                await self._app(scope, session.receive, session.send)
            elif request.is_change:
                await self._app(scope, receive, audited.send)
            else:
                await self._read(scope, receive, audited.send)

    async def _read(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            async with self._reads.turn(send) as turn:
                await self._app(scope, receive, turn.send)
        except AccessDenied as denied:  # of too many; those of routes are answered by the app
            await _deny(denied, scope, receive, send)

    async def _admit(self, scope: Scope, receive: Receive, request: IncomingRequest) -> Receive:
        if request.is_stop:
            scope["state"][IDENTITY] = self._access.admit_stop(request)
            scope["headers"] = _as_json(scope["headers"])
            return replay(await read_stop_body(receive), receive)
        scope["state"][IDENTITY] = self._access.admit(request)
        if not request.is_change:
            return receive
        return replay(await read_body(request, receive), receive)


class Require:
    """Admit users who have a role; a test finds by it the routes that require none.

    It is a coroutine, so that no request, and the stop least of all, waits for a thread: there are
    40 of them, and answers that read slow disks may hold them all.
    """

    def __init__(self, role: UserRole) -> None:
        self.role = role

    async def __call__(self, connection: HTTPConnection) -> Identity:
        """Return the identity of the user.

        Raises:
            AccessDenied: the user is not logged in, or the user's role is too low.
        """
        note_required(connection, self.role)
        identity: Identity = getattr(connection.state, IDENTITY)
        if identity.role.allows(self.role):
            return identity
        if identity.role is UserRole.ANYONE:
            raise AccessDenied(
                Denial.LOGIN_NEEDED,
                f"this needs the role {self.role}",
                "log in, or send a token; on the robot a link does it: vla-deploy dashboard",
            )
        raise AccessDenied(
            Denial.ROLE_TOO_LOW,
            f"{identity.user} is {identity.role}, this needs {self.role}",
            "ask an admin",
        )


_REQUIRED: Final = {role: Require(role) for role in UserRole}


def require(role: UserRole) -> Require:
    """Return the dependency of a route that needs a role: `Depends(require(UserRole.VIEWER))`."""
    return _REQUIRED[role]


Anyone = Annotated[Identity, Depends(require(UserRole.ANYONE))]
Viewer = Annotated[Identity, Depends(require(UserRole.VIEWER))]
Operator = Annotated[Identity, Depends(require(UserRole.OPERATOR))]
Admin = Annotated[Identity, Depends(require(UserRole.ADMIN))]


def guard(app: FastAPI, access: AccessControl) -> None:
    """Put access control before every route of an application."""
    app.state.access = access
    app.add_middleware(AccessGuard, access=access)
    app.add_exception_handler(AccessDenied, _answer)


async def _answer(connection: HTTPConnection, denied: Exception) -> JSONResponse:
    """Return the response to a denial that a route raised; a WebSocket is denied here."""
    assert isinstance(denied, AccessDenied)
    note_code(connection.scope, denied.code)
    if isinstance(connection, WebSocket):
        await _deny_websocket(denied, connection)
    return denial_response(denied)


async def _deny(denied: AccessDenied, scope: Scope, receive: Receive, send: Send) -> None:
    note_code(scope, denied.code)
    if scope["type"] == "websocket":
        await _deny_websocket(denied, WebSocket(scope, receive, send))
    else:
        await denial_response(denied)(scope, receive, send)


async def _deny_websocket(denied: AccessDenied, websocket: WebSocket) -> None:
    if _DENIAL_EXTENSION in websocket.scope.get("extensions", {}):
        await websocket.send_denial_response(denial_response(denied))
    else:
        await websocket.close(_POLICY_VIOLATION, denied.what)


def _as_json(headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Declare the body as JSON, which it is after `read_stop_body`."""
    kept = [one for one in headers if one[0].lower() not in _OF_BODY]
    return [*kept, (b"content-type", b"application/json")]
