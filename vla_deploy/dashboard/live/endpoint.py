"""Serve the live topics over a WebSocket, `/live`.

A client sends {"subscribe": [topic, ...]} any number of times; each replaces the one before. Other
text is answered by a message of the topic "error", and too much of it ends the connection.

Uvicorn frames each message anew for each client, in a write of its own, and closes a connection
only after it has sent everything that waits: never, to a client that reads nothing. `LiveProtocol`
takes frames that are made once for all clients, and can abort a connection.
"""

import asyncio
import contextlib
import json
from collections.abc import Sequence
from typing import Any, Final

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from uvicorn.protocols.utils import ClientDisconnected

from vla_deploy.dashboard.access import Viewer
from vla_deploy.dashboard.access.connections import BoundedWebSocket
from vla_deploy.dashboard.live.hub import STEP_S, LiveClient, LiveHub, Send
from vla_deploy.dashboard.live.message import LiveMessage

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

    async def send_frames(messages: Sequence[LiveMessage]) -> None:
        frames = b"".join(message.frame for message in messages)
        await websocket.send({"type": "websocket.send", "frames": frames})

    async def send_each(messages: Sequence[LiveMessage]) -> None:
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


LONGEST_TEXT: Final = 8_192
MOST_FAULTS: Final = 20
TRY_LATER: Final = 1013
BAD_TALK: Final = 1008

router = APIRouter()


@router.websocket("/live")
async def live(websocket: WebSocket, _: Viewer) -> None:
    """Bring a client what it subscribes to until it goes, or takes nothing any more."""
    hub: LiveHub = websocket.app.state.live
    await websocket.accept()
    if hub.is_full:
        await websocket.close(TRY_LATER, "too many clients are connected; close a page elsewhere")
        return
    client = LiveClient(sender_of(websocket), hub.clock)
    delivering = hub.join(client)
    listening = asyncio.create_task(_listen(websocket, hub, client))
    try:
        await asyncio.wait((delivering, listening), return_when=asyncio.FIRST_COMPLETED)
        is_frozen = delivering.done() and delivering.cancelled()
    finally:
        hub.leave(client)
        listening.cancel()
    await asyncio.wait((delivering, listening))
    await _end(websocket, delivering, listening, is_frozen=is_frozen)


async def _listen(websocket: WebSocket, hub: LiveHub, client: LiveClient) -> None:
    """Take what the client wants, not faster than there is anything to bring."""
    faults = 0
    while faults < MOST_FAULTS:
        fault = _heed(await _next_text(websocket), hub, client)
        if fault:
            faults += 1
            await websocket.send_json({"topic": "error", "data": fault})
        await asyncio.sleep(STEP_S)


async def _next_text(websocket: WebSocket) -> str:
    message = await websocket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005))
    return message.get("text") or ""


async def _end(websocket: WebSocket, *tasks: "asyncio.Task[None]", is_frozen: bool) -> None:
    """Close the connection, unless the client has gone; raise what else ended a task."""
    errors = [task.exception() for task in tasks if not task.cancelled()]
    for error in filter(None, errors):
        if isinstance(error, WebSocketDisconnect):
            return
        raise error
    if is_frozen:
        await cut_off(websocket)
    else:
        await websocket.close(BAD_TALK, 'expected {"subscribe": [topic, ...]}')


def _heed(text: str, hub: LiveHub, client: LiveClient) -> dict[str, str]:
    """Do what a client asks; return what is wrong with it, empty where nothing is."""
    topics = _topics_in(text)
    if topics is None:
        return {
            "code": "invalid",
            "what": f'expected {{"subscribe": [topic, ...]}}, got {text[:80]!r}',
            "try": "send JSON text; topics are those of the schema table",
        }
    hub.subscribe(client, topics & hub.topics)
    unknown = sorted(topics - hub.topics)
    if not unknown:
        return {}
    return {
        "code": "unknown_topic",
        "what": f"no live topic {', '.join(unknown)[:200]}",
        "try": f"one of {', '.join(sorted(hub.topics))}",
    }


def _topics_in(text: str) -> frozenset[str] | None:
    """Return the topics that a subscription names, None where it is none."""
    if len(text) > LONGEST_TEXT:
        return None
    try:
        asked: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    topics = asked.get("subscribe") if isinstance(asked, dict) else None
    if not isinstance(topics, list) or not all(isinstance(topic, str) for topic in topics):
        return None
    return frozenset(topics)
