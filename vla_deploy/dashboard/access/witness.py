"""See what becomes of an act, and tell it to the audit log."""

from types import TracebackType
from typing import Any, Final

from starlette.requests import HTTPConnection
from starlette.types import Message, Scope, Send

from vla_deploy.client.access.accounts import Role
from vla_deploy.client.access.audit_log import (
    STOP_FOLD_S,
    AuditEntry,
    AuditLog,
    Outcome,
    outcome_of,
)
from vla_deploy.dashboard.access.asked import API_PREFIX, WEBSOCKET, Asked
from vla_deploy.dashboard.access.identity import IDENTITY, Identity

NO_ROUTE: Final = "(no route)"
_DETAILS: Final = "audit_details"
_REQUIRED: Final = "required_role"
_CODE: Final = "refusal_code"
_ANSWERS: Final = ("http.response.start", "websocket.http.response.start")


def note(connection: HTTPConnection, **details: Any) -> None:
    """Have the audit log tell details of an act, such as the text of a command; no secrets."""
    known = connection.scope["state"].setdefault(_DETAILS, {})
    known.update(details)


def note_required(connection: HTTPConnection, role: Role) -> None:
    """Remember which role a route needs."""
    connection.scope["state"][_REQUIRED] = role


def note_refusal(scope: Scope, code: str) -> None:
    """Remember why an act was refused."""
    scope["state"][_CODE] = code


class Witness:
    """Watch the answer to one request; every change is told, and every WebSocket for operators."""

    def __init__(self, scope: Scope, asked: Asked, send: Send, audit: AuditLog) -> None:
        self._scope = scope
        self._asked = asked
        self._send = send
        self._audit = audit
        self._is_told = False

    async def send(self, message: Message) -> None:
        """Pass a message on to whoever asked; the first of an answer says what became of it."""
        if message["type"] in _ANSWERS:
            self._tell(outcome_of(message["status"]))
        elif message["type"] == "websocket.accept":
            self._tell(Outcome.DONE)
        await self._send(message)

    def __enter__(self) -> None:
        return None

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        if isinstance(error, Exception):
            self._tell(Outcome.FAILED)

    def _tell(self, outcome: Outcome) -> None:
        state = self._scope["state"]
        if self._is_told or not self._is_act(state.get(_REQUIRED, Role.ANYONE), outcome):
            return
        self._is_told = True
        who: Identity = state[IDENTITY]
        parameters = self._scope.get("path_params", {})
        entry = AuditEntry(
            user=who.user,
            role=who.role,
            way=who.way,
            address=who.address,
            act=self._act(),
            outcome=outcome,
            code=state.get(_CODE, ""),
            details={**parameters, **state.get(_DETAILS, {})},
        )
        self._audit.tell(entry, STOP_FOLD_S if self._asked.is_stop else 0.0)

    def _is_act(self, required: Role, outcome: Outcome) -> bool:
        if self._asked.method == WEBSOCKET:
            return required.allows(Role.OPERATOR) or outcome is not Outcome.DONE
        return self._asked.is_change

    def _act(self) -> str:
        """Return method and route: a path that is none could be as long and odd as one likes."""
        if self._asked.is_stop:
            return f"POST {self._asked.path}"
        path = getattr(self._scope.get("route"), "path", NO_ROUTE)
        is_below = path != NO_ROUTE and self._asked.path.startswith(API_PREFIX)
        if is_below and not path.startswith(API_PREFIX):  # routers know only what is below it
            path = API_PREFIX + path
        return f"{self._asked.method} {path}"
