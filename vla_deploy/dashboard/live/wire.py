"""Serve WebSockets so that what fifty clients get is framed once, and one of them can be cut off.

Uvicorn frames each message anew for each client, in a write of its own, and closes a connection
only when all that waits has been sent: never, to a client that reads nothing.
"""

import asyncio
import contextlib
from collections.abc import Sequence
from typing import Any, Final

from fastapi import WebSocket, WebSocketDisconnect
from uvicorn.protocols.utils import ClientDisconnected

from vla_deploy.dashboard.access.connections import BoundedWebSocket
from vla_deploy.dashboard.live.hub import Send
from vla_deploy.dashboard.live.message import Message

FRAMES: Final = "vla_deploy.frames"
"""The extension of ASGI by which the protocol says that it takes `frames`, and `abort`."""
FROZEN: Final = 1008
LOST: Final = 1006
_CLOSING_S: Final = 1.0


class LiveProtocol(BoundedWebSocket):
    """Be uvicorn's protocol, but take whole frames, and close at once where that is asked.

    Frames are the same for all clients as long as nothing is compressed: it takes its place
    together with `ws_per_message_deflate=False`.
    """

    async def run_asgi(self) -> None:
        """Run the application, which finds the extension in its scope."""
        if not self.conn.extensions:
            self.scope["extensions"] = {**(self.scope["extensions"] or {}), FRAMES: {}}
        await super().run_asgi()

    async def send(self, message: Any) -> None:
        """Send an event of ASGI.

        Raises:
            ClientDisconnected: the connection has gone.
        """
        if message.get("abort"):
            self.transport.abort()
        elif "frames" in message:
            await self.writable.wait()
            if self.disconnected or self.close_sent or self.transport.is_closing():
                raise ClientDisconnected
            self.transport.write(message["frames"])
        else:
            await super().send(message)

    async def receive(self) -> Any:
        """Return the next event, which lets more of them come."""
        event = await super().receive()
        if not self.writable.is_set():
            self.transport.pause_reading()
        return event

    def pause_writing(self) -> None:
        """Hear nothing from a client that takes nothing: it would be owed a pong for each ping."""
        super().pause_writing()
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        """Hear the client again, unless an event of it still waits."""
        super().resume_writing()
        if not self.read_paused:
            self.transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell a connection that was lost from one that was closed: uvicorn calls both 1005."""
        if self.handshake_complete and self.conn.close_rcvd is None:
            self.queue.put_nowait({"type": "websocket.disconnect", "code": LOST})
        super().connection_lost(exc)

    def keepalive_timeout(self) -> None:
        """Cut off a client that answers no ping: it would not read a farewell either."""
        self.transport.abort()


def sender_of(websocket: WebSocket) -> Send:
    """Return what sends messages to a client, all of them in one write where the server can."""

    async def send_frames(messages: Sequence[Message]) -> None:
        frames = b"".join(message.frame for message in messages)
        await websocket.send({"type": "websocket.send", "frames": frames})

    async def send_each(messages: Sequence[Message]) -> None:
        for message in messages:
            await (
                websocket.send_text(message.content)
                if isinstance(message.content, str)
                else websocket.send_bytes(message.content)
            )

    return send_frames if FRAMES in websocket.scope.get("extensions", {}) else send_each


async def cut_off(websocket: WebSocket) -> None:
    """End a connection whose client reads nothing: at once where the server can."""
    farewell = {"type": "websocket.close", "code": FROZEN, "reason": "you take nothing"}
    with contextlib.suppress(WebSocketDisconnect, TimeoutError):  # it has gone: that was wanted
        await asyncio.wait_for(websocket.send({**farewell, "abort": True}), _CLOSING_S)
