"""Close a WebSocket when whoever opened it may no longer have it."""

from collections.abc import Callable
from typing import Final

from starlette.types import Message, Receive, Send

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.access.accounts import Role

LOOK_NS: Final = 5 * NS_PER_S
_POLICY_VIOLATION: Final = 1008
_CLOSED: Final[Message] = {"type": "websocket.disconnect", "code": _POLICY_VIOLATION}


class Tenure:
    """Pass messages of one WebSocket while its owner's role stands.

    A token that is revoked, a password that is changed, a session that has ended: with the first
    message that is 5 s younger the WebSocket is closed.
    """

    def __init__(
        self, receive: Receive, send: Send, role_now: Callable[[], Role], clock: Clock
    ) -> None:
        self._receive = receive
        self._send = send
        self._role_now = role_now
        self._clock = clock
        self._role = role_now()
        self._looked_ns = clock.now_ns()
        self._is_over = False

    async def receive(self) -> Message:
        """Return the next message, or that the WebSocket is closed."""
        message = await self._receive()
        return message if await self._stands() else _CLOSED

    async def send(self, message: Message) -> None:
        """Pass a message on, unless the WebSocket is closed."""
        if await self._stands():
            await self._send(message)

    async def _stands(self) -> bool:
        now_ns = self._clock.now_ns()
        if self._is_over or now_ns - self._looked_ns < LOOK_NS:
            return not self._is_over
        self._looked_ns = now_ns
        self._is_over = not self._role_now().allows(self._role)
        if self._is_over:
            reason = "the session or token has ended"
            close = {"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": reason}
            await self._send(close)
        return not self._is_over
