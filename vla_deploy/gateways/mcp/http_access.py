"""Serve agents by HTTP on this computer alone, to those with a token of the dashboard."""

import contextlib
import ipaddress
from typing import Final

import uvicorn
from starlette.datastructures import Headers
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from vla_deploy.client.access.accounts import AccountsFile, UserRole, wall_s
from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.client.access.errors import AccessError
from vla_deploy.client.agent_lease import AGENT
from vla_deploy.gateways.mcp.errors import NotLoopback
from vla_deploy.gateways.mcp.server import TOKEN_NAME

LOOPBACK: Final = "127.0.0.1"
_BEARER: Final = "bearer "


class TokenCheck:
    """Pass on requests with a token that counts, under the token's name."""

    def __init__(self, app: ASGIApp, accounts: AccountsFile, audit: AuditLog) -> None:
        self._app = app
        self._accounts = accounts
        self._audit = audit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check one request."""
        if scope["type"] == "http":
            name = self._name_of(Headers(scope=scope).get("authorization", ""))
            if not name:
                self._refused()
                what = "expected Authorization: Bearer vla_..., with a token that counts"
                how = "make one: vla-deploy dashboard token add NAME --role viewer"
                answer = {"error": {"code": "token_refused", "what": what, "try": how}}
                await JSONResponse(answer, status_code=401)(scope, receive, send)
                return
            scope[TOKEN_NAME] = name
        await self._app(scope, receive, send)

    def _name_of(self, authorization: str) -> str:
        if not authorization.lower().startswith(_BEARER):
            return ""
        with contextlib.suppress(AccessError):
            text = authorization[len(_BEARER) :].strip()
            token = self._accounts.read().token_of(text, wall_s())
            if token is not None and token.role.allows(UserRole.VIEWER):
                return token.name
        return ""

    def _refused(self) -> None:
        entry = AuditEntry(
            user="anyone",
            role=UserRole.ANYONE,
            way="mcp",
            address="http",
            act=f"{AGENT} request",
            outcome=AuditOutcome.REFUSED,
            code="token_refused",
        )
        self._audit.record(entry)


def check_loopback(host: str) -> None:
    """Accept addresses of this computer.

    Raises:
        NotLoopback: it is another address, or a name.
    """
    with contextlib.suppress(ValueError):
        if ipaddress.ip_address(host).is_loopback:
            return
    raise NotLoopback(
        f"agents are served on this computer alone: expected {LOOPBACK} or ::1, got {host!r:.60}; "
        "to reach it from elsewhere, forward the port by ssh -L"
    )


async def serve_http(app: ASGIApp, host: str, port: int) -> None:
    """Serve until a signal ends the process.

    Raises:
        NotLoopback: the address is not of this computer.
    """
    check_loopback(host)
    config = uvicorn.Config(app, host=host, port=port, log_level="warning", access_log=False)
    await uvicorn.Server(config).serve()
