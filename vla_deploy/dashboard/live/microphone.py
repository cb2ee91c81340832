"""Take sound from a browser's microphone, and hand it to the speech process: `/microphone`.

A client sends {"rate_hz": 16000} or 48000, is told {"floor": "yours"}, and then sends PCM, 16 bit,
little-endian, one channel. What ends its turn is told as the reason of the connection's end.
"""

import asyncio
import secrets
from typing import Any, Final

from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from drivers.clock import MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import Operator
from vla_deploy.dashboard.live.turn import (
    SILENT_S,
    Floor,
    Turn,
    TurnRefused,
    check_end,
    rate_in,
)
from vla_deploy.ipc import RecordWriter
from vla_deploy.ipc.page_sound import NOTHING, PageSound, Samples, SoundStep

LET_GO: Final = frozenset({1000, 1005})
"""How a page closes a connection; one that is lost, or a page that is left, closes it otherwise."""
_LONGEST_REASON: Final = 120
_EARS_S: Final = 3.0

router = APIRouter()


class PageMicrophones:
    """Hold the floor and the way to the speech process."""

    def __init__(self, link: RobotLink) -> None:
        self.floor = Floor()
        self.clock = MonotonicClock()
        """By which people speak, whatever time the robot lives by."""
        self._link = link
        self._records: RecordWriter = link.space.record_writer("page_sound")

    def check_ears(self) -> None:
        """Make sure that somebody listens.

        Raises:
            TurnRefused: the speech process does not run.
        """
        if self._link.fresh("speech_status", _EARS_S) is None:
            raise TurnRefused(1013, "deaf", "the robot's speech process does not run")

    def hand_on(self, turn: "OpenTurn", step: SoundStep, samples: Samples = NOTHING) -> None:
        """Give a step of a turn to the speech process."""
        rate_hz = turn.rules.rate_hz
        sound = PageSound(turn=turn.number, rate_hz=rate_hz, step=step, samples=samples)
        self._records.append(sound.packed())


class OpenTurn:
    """Carry one turn over its connection."""

    def __init__(self, websocket: WebSocket, microphones: PageMicrophones, rate_hz: int) -> None:
        self.number = secrets.randbits(32)
        self.rules = Turn(rate_hz, microphones.clock.now_ns())
        self._websocket = websocket
        self._microphones = microphones

    async def listen(self) -> None:
        """Hand on what comes until the button is let go.

        Raises:
            TurnRefused: what came is not taken.
            WebSocketDisconnect: the connection was lost.
        """
        step = SoundStep.CUT
        try:
            while (data := await self._next()) is not None:
                samples = self.rules.take(data, self._microphones.clock.now_ns())
                self._microphones.hand_on(self, SoundStep.SOUND, samples)
            step = SoundStep.ENDED
        finally:
            self._microphones.hand_on(self, step)

    async def _next(self) -> bytes | None:
        """Return the next sound, None once the button is let go."""
        message = await received(self._websocket)
        if message["type"] == "websocket.disconnect":
            code = message.get("code", 1005)
            if code not in LET_GO:
                raise WebSocketDisconnect(code)
            return None
        if (data := message.get("bytes")) is not None:
            return bytes(data)
        check_end(message.get("text") or "")
        return None


@router.websocket("/microphone")
async def microphone(websocket: WebSocket, who: Operator) -> None:
    """Let a person speak to the robot."""
    microphones: PageMicrophones = websocket.app.state.microphones
    await websocket.accept()
    try:
        await _speak(websocket, microphones, who.user)
        await _close(websocket, 1000, "")
    except TurnRefused as refusal:
        await _close(websocket, refusal.code, str(refusal))
    except WebSocketDisconnect:
        return  # whoever spoke has gone; their turn was cut off


async def _speak(websocket: WebSocket, microphones: PageMicrophones, speaker: str) -> None:
    first = await received(websocket)
    if first["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(first.get("code", 1005))
    rate_hz = rate_in(first.get("text") or "")
    microphones.check_ears()
    microphones.floor.take(speaker)
    try:
        await websocket.send_json({"floor": "yours"})
        await OpenTurn(websocket, microphones, rate_hz).listen()
    finally:
        microphones.floor.leave()


async def received(websocket: WebSocket) -> Any:
    """Return the next event of a connection.

    Raises:
        TurnRefused: none came for too long.
    """
    try:
        return await asyncio.wait_for(websocket.receive(), SILENT_S)
    except TimeoutError as error:
        what = f"no sound came for {SILENT_S:g} s; is the microphone allowed?"
        raise TurnRefused(4408, "silent", what) from error


async def _close(websocket: WebSocket, code: int, reason: str) -> None:
    try:
        await websocket.close(code, reason.encode()[:_LONGEST_REASON].decode(errors="ignore"))
    except (RuntimeError, WebSocketDisconnect):
        return  # the client has closed it already
