"""Close a WebSocket once the session or token that opened it has ended."""

from collections.abc import Callable
from typing import Final

from starlette.types import Message, Receive, Send

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.access.accounts import UserRole

CHECK_NS: Final = 5 * NS_PER_S
_POLICY_VIOLATION: Final = 1008
_CLOSED: Final[Message] = {"type": "websocket.disconnect", "code": _POLICY_VIOLATION}


class SessionExpiry:
    """Pass on the messages of one WebSocket until its session or token ends.

    The role is checked again with the first message after 5 s: a revoked token, a changed
    password and an ended session close the WebSocket.
    """

    def __init__(
        self, receive: Receive, send: Send, role_now: Callable[[], UserRole], clock: Clock
    ) -> None:
        self._receive = receive
        self._send = send
        self._role_now = role_now
        self._clock = clock
        self._role = role_now()
        self._checked_ns = clock.now_ns()
        self._is_over = False

    async def receive(self) -> Message:
        """Return the next message, a disconnect once the session has ended."""
        message = await self._receive()
        return message if await self._is_valid() else _CLOSED

    async def send(self, message: Message) -> None:
        """Pass on a message, unless the session has ended."""
        if await self._is_valid():
            await self._send(message)

    async def _is_valid(self) -> bool:
        now_ns = self._clock.now_ns()
        if self._is_over or now_ns - self._checked_ns < CHECK_NS:
            return not self._is_over
        self._checked_ns = now_ns
        self._is_over = not self._role_now().allows(self._role)
        if self._is_over:
            reason = "the session or token has ended"
            close = {"type": "websocket.close", "code": _POLICY_VIOLATION, "reason": reason}
            await self._send(close)
        return not self._is_over
