"""Record in the audit log the outcome of each request that changes something."""

from types import TracebackType
from typing import Any, Final

from starlette.requests import HTTPConnection
from starlette.types import Message, Scope, Send

from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.audit_log import (
    STOP_FOLD_S,
    AuditEntry,
    AuditLog,
    AuditOutcome,
    outcome_of,
)
from vla_deploy.dashboard.access.identity import IDENTITY, Identity
from vla_deploy.dashboard.access.request import API_PREFIX, WEBSOCKET, IncomingRequest

NO_ROUTE: Final = "(no route)"
_DETAILS: Final = "audit_details"
_REQUIRED: Final = "required_role"
_CODE: Final = "refusal_code"
_ANSWERS: Final = ("http.response.start", "websocket.http.response.start")


def note(connection: HTTPConnection, **details: Any) -> None:
    """Add details of a request to its audit entry, such as the text of a command; no secrets."""
    known = connection.scope["state"].setdefault(_DETAILS, {})
    known.update(details)


def note_required(connection: HTTPConnection, role: UserRole) -> None:
    """Note for the audit entry which role the route needs."""
    connection.scope["state"][_REQUIRED] = role


def note_code(scope: Scope, code: str) -> None:
    """Note for the audit entry why the request was denied."""
    scope["state"][_CODE] = code


class AuditMiddleware:
    """Record one request by its answer: every change, and every WebSocket for operators."""

    def __init__(self, scope: Scope, request: IncomingRequest, send: Send, audit: AuditLog) -> None:
        self._scope = scope
        self._request = request
        self._send = send
        self._audit = audit
        self._is_recorded = False

    async def send(self, message: Message) -> None:
        """Pass on a message of the answer; the first one has the outcome."""
        if message["type"] in _ANSWERS:
            self._record(outcome_of(message["status"]))
        elif message["type"] == "websocket.accept":
            self._record(AuditOutcome.DONE)
        await self._send(message)

    def __enter__(self) -> None:
        return None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if isinstance(error, Exception):
            self._record(AuditOutcome.FAILED)

    def _record(self, outcome: AuditOutcome) -> None:
        state = self._scope["state"]
        if self._is_recorded or not self._is_act(state.get(_REQUIRED, UserRole.ANYONE), outcome):
            return
        self._is_recorded = True
        identity: Identity = state[IDENTITY]
        parameters = self._scope.get("path_params", {})
        entry = AuditEntry(
            user=identity.user,
            role=identity.role,
            way=identity.way,
            address=identity.address,
            act=self._act(),
            outcome=outcome,
            code=state.get(_CODE, ""),
            details={**parameters, **state.get(_DETAILS, {})},
        )
        self._audit.record(entry, STOP_FOLD_S if self._request.is_stop else 0.0)

    def _is_act(self, required: UserRole, outcome: AuditOutcome) -> bool:
        if self._request.method == WEBSOCKET:
            return required.allows(UserRole.OPERATOR) or outcome is not AuditOutcome.DONE
        return self._request.is_change

    def _act(self) -> str:
        """Return method and route, not the path: an unknown path may be of any length."""
        if self._request.is_stop:
            return f"POST {self._request.path}"
        path = getattr(self._scope.get("route"), "path", NO_ROUTE)
        is_below = path != NO_ROUTE and self._request.path.startswith(API_PREFIX)
        if is_below and not path.startswith(API_PREFIX):  # routers have their paths without it
            path = API_PREFIX + path
        return f"{self._request.method} {path}"
