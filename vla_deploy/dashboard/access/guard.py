"""Stand before every route: judge who asks, bound what is sent, tell what was done."""

from typing import Final

from starlette.types import ASGIApp, Receive, Scope, Send

from vla_deploy.dashboard.access.access import Access
from vla_deploy.dashboard.access.answers import refuse
from vla_deploy.dashboard.access.asked import WEBSOCKET, Asked, asked_of
from vla_deploy.dashboard.access.body import read_body, read_stop_body, replay
from vla_deploy.dashboard.access.errors import RequestRefused
from vla_deploy.dashboard.access.identity import IDENTITY, nobody
from vla_deploy.dashboard.access.witness import Witness


class AccessGuard:
    """Let through what may be asked, with `request.state.identity` told to the routes."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app = app
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Judge one request or WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        asked = asked_of(scope)
        scope.setdefault("state", {})[IDENTITY] = nobody(asked.peer.address)
        witness = Witness(scope, asked, send, self._access.audit)
        try:
            receive = await self._admit(scope, receive, asked)
        except RequestRefused as refusal:
            await refuse(refusal, scope, receive, witness.send)
            return
        with witness:
            if asked.method == WEBSOCKET:
                tenure = self._access.tenure(asked, receive, witness.send)
                await self._app(scope, tenure.receive, tenure.send)
            else:
                await self._app(scope, receive, witness.send)

    async def _admit(self, scope: Scope, receive: Receive, asked: Asked) -> Receive:
        if asked.is_stop:
            scope["state"][IDENTITY] = self._access.admit_stop(asked)
            scope["headers"] = _as_json(scope["headers"])
            return replay(await read_stop_body(receive), receive)
        scope["state"][IDENTITY] = self._access.admit(asked)
        if not asked.is_change:
            return receive
        return replay(await read_body(asked, receive), receive)


_OF_BODY: Final = (b"content-type", b"content-length")


def _as_json(headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Say that the body is JSON, as it now is."""
    kept = [one for one in headers if one[0].lower() not in _OF_BODY]
    return [*kept, (b"content-type", b"application/json")]
