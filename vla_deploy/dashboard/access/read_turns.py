"""Let only so many reads be answered at a time: the event loop belongs to the stop first."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from starlette.types import Message, Send

from vla_deploy.dashboard.errors import AccessDenied, Denial

AT_ONCE: Final = 3
MOST_WAITING: Final = 64
_BEGINNINGS: Final = ("http.response.start",)


class ReadTurn:
    """Hold the turn of one read, until its answer begins: a slow client must not keep it."""

    def __init__(self, turns: asyncio.Semaphore, send: Send) -> None:
        self._turns = turns
        self._send = send
        self._is_held = True

    async def send(self, message: Message) -> None:
        """Pass on a message of the answer; with the first one the next read gets its turn."""
        if message["type"] in _BEGINNINGS:
            self.end()
        await self._send(message)

    def end(self) -> None:
        """Give the turn back; twice is allowed."""
        if self._is_held:
            self._is_held = False
            self._turns.release()


class ReadTurns:
    """Hold the turns of all reads; the stop, logins and changes need none."""

    def __init__(self, at_once: int = AT_ONCE, most_waiting: int = MOST_WAITING) -> None:
        self._turns = asyncio.Semaphore(at_once)
        self._most_waiting = most_waiting
        self._waiting = 0

    @asynccontextmanager
    async def turn(self, send: Send) -> AsyncIterator[ReadTurn]:
        """Wait for a turn.

        Raises:
            AccessDenied: too many reads wait already.
        """
        if self._waiting >= self._most_waiting:
            raise AccessDenied(
                Denial.TOO_MANY_READS, "too many reads at a time", "ask later", wait_s=1.0
            )
        self._waiting += 1
        try:
            await self._turns.acquire()
        finally:
            self._waiting -= 1
        turn = ReadTurn(self._turns, send)
        try:
            yield turn
        finally:
            turn.end()
