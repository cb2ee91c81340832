"""Serve the live topics over a WebSocket, `/live`.

A client sends {"subscribe": [topic, ...]} any number of times; each replaces the one before. Other
text is answered by a message of the topic "error", and too much of it ends the connection.

Uvicorn frames each message again for each client, in a write of its own, and closes a connection
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

LONGEST_TEXT: Final = 8_192
MOST_FAULTS: Final = 20
LOST: Final = 1006
POLICY_VIOLATION: Final = 1008
TRY_LATER: Final = 1013

router = APIRouter()


class LiveProtocol(BoundedWebSocket):
    """Extend uvicorn's protocol: send whole frames, and abort a connection on request.

    Frames are the same for all clients only without compression, so it needs
    `ws_per_message_deflate=False`.
    """

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
        """Return the next event; read on only while the client takes what is sent."""
        event = await super().receive()
        if not self.writable.is_set():
            self.transport.pause_reading()
        return event

    def pause_writing(self) -> None:
        """Read nothing from a client that takes nothing: pongs for its pings would pile up."""
        super().pause_writing()
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        """Read again, unless an event still waits."""
        super().resume_writing()
        if not self.read_paused:
            self.transport.resume_reading()

    def connection_lost(self, exc: Exception | None) -> None:
        """Report a lost connection as 1006: uvicorn reports 1005, as for a closed one."""
        if self.handshake_complete and self.conn.close_rcvd is None:
            self.queue.put_nowait({"type": "websocket.disconnect", "code": LOST})
        super().connection_lost(exc)

    def keepalive_timeout(self) -> None:
        """Abort the connection of a client that answers no ping: it reads no close frame either."""
        self.transport.abort()


def _sender(websocket: WebSocket) -> Send:
    """Return what sends messages to a client, all of them in one write."""

    async def send(messages: Sequence[LiveMessage]) -> None:
        frames = b"".join(message.frame for message in messages)
        await websocket.send({"type": "websocket.send", "frames": frames})

    return send


async def _cut_off(websocket: WebSocket) -> None:
    """Abort a connection whose client reads nothing."""
    close = {"type": "websocket.close", "code": POLICY_VIOLATION, "abort": True}
    with contextlib.suppress(WebSocketDisconnect):  # the client has gone already
        await websocket.send(close)


@router.websocket("/live")
async def live(websocket: WebSocket, _: Viewer) -> None:
    """Send a client its topics until it disconnects or takes nothing."""
    hub: LiveHub = websocket.app.state.live
    await websocket.accept()
    if hub.is_full:
        await websocket.close(TRY_LATER, "too many clients are connected; close a page elsewhere")
        return
    client = LiveClient(_sender(websocket), hub.clock)
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
    """Take subscriptions, at most one each step of the hub."""
    faults = 0
    while faults < MOST_FAULTS:
        fault = _subscribe(await _next_text(websocket), hub, client)
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
    """Close the connection, unless the client has gone; raise other errors of the tasks."""
    errors = [task.exception() for task in tasks if not task.cancelled()]
    for error in filter(None, errors):
        if isinstance(error, WebSocketDisconnect):
            return
        raise error
    if is_frozen:
        await _cut_off(websocket)
    else:
        await websocket.close(POLICY_VIOLATION, 'expected {"subscribe": [topic, ...]}')


def _subscribe(text: str, hub: LiveHub, client: LiveClient) -> dict[str, str]:
    """Apply a client's subscription; return what is wrong with it, if anything."""
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
    """Return the topics of a subscription, None for any other text."""
    if len(text) > LONGEST_TEXT:
        return None
    try:
        document: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    topics = document.get("subscribe") if isinstance(document, dict) else None
    if not isinstance(topics, list) or not all(isinstance(topic, str) for topic in topics):
        return None
    return frozenset(topics)
