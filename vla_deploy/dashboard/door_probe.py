"""Ask the dashboard through its own door, as a page does: one that answers nobody is found so."""

import asyncio
import contextlib
import socket
import ssl
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock

PERIOD_S: Final = 2.0
WITHIN_S: Final = 4.0
SILENT_S: Final = 10.0
_REQUEST: Final = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
_ANSWER: Final = b"HTTP/1.1 200"


class DoorProbe:
    """Connect to a listening socket of this process again and again, and note the last answer.

    Another process takes the silence of `dashboard_status` for that of the dashboard, and starts
    it anew; it is published only while somebody is answered.
    """

    def __init__(
        self, listener: socket.socket, *, is_tls: bool, clock: Clock | None = None
    ) -> None:
        self._address = listener.getsockname()
        self._family = listener.family
        self._tls = _own_context() if is_tls else None
        self._clock = clock or MonotonicClock()  # of requests, also in the twin's time
        self._answered_ns = self._clock.now_ns()

    @property
    def is_silent(self) -> bool:
        """Return whether there was no answer for `SILENT_S`."""
        return self._clock.now_ns() - self._answered_ns > SILENT_S * NS_PER_S

    async def run(self) -> None:
        """Ask until cancelled."""
        while True:
            await self.ask()
            await asyncio.sleep(PERIOD_S)

    async def ask(self) -> None:
        """Ask once, and note the answer if there is one in time."""
        with contextlib.suppress(OSError, TimeoutError):
            async with asyncio.timeout(WITHIN_S):
                if (await self._first_bytes()).startswith(_ANSWER):
                    self._answered_ns = self._clock.now_ns()

    async def _first_bytes(self) -> bytes:
        reader, writer = await asyncio.open_connection(
            *self._address[:2], family=self._family, ssl=self._tls
        )
        try:
            writer.write(_REQUEST)
            return await reader.read(len(_ANSWER))
        finally:
            writer.transport.abort()


def _own_context() -> ssl.SSLContext:
    """Return a context that takes any certificate: it talks to this very process."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context
