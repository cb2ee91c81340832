"""Speak with the clients of the live topics: WebSocket `/live`.

A client sends {"subscribe": [topic, ...]}, as often as it likes; each replaces the one before. What
is none of that is answered by a message of the topic "error", and too much of it ends the talk.
"""

import asyncio
import json
from typing import Any, Final

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from vla_deploy.dashboard.access import Viewer
from vla_deploy.dashboard.live.hub import STEP_S, Client, LiveHub
from vla_deploy.dashboard.live.wire import cut_off, sender_of

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
    client = Client(sender_of(websocket), hub.clock)
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


async def _listen(websocket: WebSocket, hub: LiveHub, client: Client) -> None:
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


def _heed(text: str, hub: LiveHub, client: Client) -> dict[str, str]:
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
