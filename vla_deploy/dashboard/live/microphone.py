"""Take sound from a browser's microphone for the speech process: WebSocket `/microphone`.

A client sends {"rate_hz": 16000} or 48000, receives {"floor": "yours"}, and then sends PCM, 16 bit,
little-endian, one channel. One user at a time has the floor, from the first message to the end of
the connection. A turn ends well when the button is released: by {"end": true}, or by closing the
connection. It is cut, and the current phrase is dropped, when the connection is lost, and by each
of these refusals, whose text is the reason of the close frame:

    1007  an odd number of bytes
    1008  unknown text
    1009  more than a second of sound in one message
    1013  the speech process does not run
    4408  no message for 3 s: a held button sends silence, too
    4409  another user speaks
    4413  more than 30 s: no command is that long
    4429  sound that is 1.5 s ahead of real time
"""

import asyncio
import json
import secrets
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from fastapi import APIRouter, WebSocket, WebSocketDisconnect

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import Operator
from vla_deploy.ipc import RecordWriter, topics
from vla_deploy.ipc.page_sound import NOTHING, RATES_HZ, PageSound, Samples, SoundStep

LARGEST_S: Final = 1.0
AHEAD_S: Final = 1.5
SILENT_S: Final = 3.0
LONGEST_S: Final = 30.0
SAMPLE_BYTES: Final = 2
RELEASED: Final = frozenset({1000, 1005})
"""Codes by which a page ends a turn; a lost connection and a closed page have others."""
_LONGEST_REASON: Final = 120
_STATUS_AGE_S: Final = 3.0

router = APIRouter()


class SpeechTurnRefused(Exception):
    """End a turn with the code and the reason of the close frame."""

    def __init__(self, code: int, what: str) -> None:
        super().__init__(what)
        self.code = code


@dataclass(slots=True)
class SpeechTurn:
    """Check the sound of one turn that began at `began_ns`."""

    rate_hz: int
    began_ns: int
    samples: int = 0

    def take(self, data: bytes, now_ns: int) -> Samples:
        """Return the samples of a message.

        Raises:
            SpeechTurnRefused: it is no sound, or too much at once.
        """
        if len(data) % SAMPLE_BYTES:
            raise SpeechTurnRefused(1007, f"{len(data)} bytes are no 16-bit samples")
        if len(data) > LARGEST_S * self.rate_hz * SAMPLE_BYTES:
            raise SpeechTurnRefused(1009, "send at most a second of sound at once")
        samples = np.frombuffer(data, "<i2").astype(np.int16)
        self.samples += len(samples)
        spoken_s, passed_s = self.samples / self.rate_hz, (now_ns - self.began_ns) / NS_PER_S
        if spoken_s > passed_s + AHEAD_S:
            raise SpeechTurnRefused(4429, "sound comes faster than it can be spoken")
        if max(spoken_s, passed_s) > LONGEST_S:
            raise SpeechTurnRefused(4413, f"nobody is heard for longer than {LONGEST_S:g} s")
        return samples


@dataclass(slots=True)
class Floor:
    """Hold the user who speaks, one at a time."""

    holder: str | None = None

    def take(self, speaker: str) -> None:
        """Give the floor to a user.

        Raises:
            SpeechTurnRefused: another user has it.
        """
        if self.holder is not None:
            raise SpeechTurnRefused(4409, f"{self.holder} speaks to the robot; wait a moment")
        self.holder = speaker

    def leave(self) -> None:
        """Release the floor."""
        self.holder = None


def rate_in(text: str) -> int:
    """Return the sample rate in the first message of a turn.

    Raises:
        SpeechTurnRefused: it has no supported rate.
    """
    rate_hz = _document(text).get("rate_hz")
    if isinstance(rate_hz, bool) or rate_hz not in RATES_HZ:
        listed = " or ".join(map(str, RATES_HZ))
        raise SpeechTurnRefused(1008, f'expected {{"rate_hz": {listed}}}, got {text[:40]!r}')
    return int(rate_hz)


def check_end(text: str) -> None:
    """Accept the text that ends a turn.

    Raises:
        SpeechTurnRefused: it is another text.
    """
    if _document(text) != {"end": True}:
        raise SpeechTurnRefused(1008, f'expected sound or {{"end": true}}, got {text[:40]!r}')


def _document(text: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


class PageMicrophones:
    """Hold the floor, and pass sound on to the speech process."""

    def __init__(self, link: RobotLink) -> None:
        self.floor = Floor()
        self.clock = MonotonicClock()
        """Real time, in which people speak, also where the robot runs in a twin's time."""
        self._link = link
        self._records: RecordWriter = link.space.record_writer(topics.PAGE_SOUND)

    def check_speech(self) -> None:
        """Check that the speech process listens.

        Raises:
            SpeechTurnRefused: the speech process does not run.
        """
        if self._link.fresh(topics.SPEECH_STATUS, _STATUS_AGE_S) is None:
            raise SpeechTurnRefused(1013, "the robot's speech process does not run")

    def publish(self, turn: "TurnConnection", step: SoundStep, samples: Samples = NOTHING) -> None:
        """Publish a step of a turn to the speech process."""
        rate_hz = turn.rules.rate_hz
        sound = PageSound(turn=turn.number, rate_hz=rate_hz, step=step, samples=samples)
        self._records.append(sound.packed())


class TurnConnection:
    """Receive one turn over its connection."""

    def __init__(self, websocket: WebSocket, microphones: PageMicrophones, rate_hz: int) -> None:
        self.number = secrets.randbits(32)
        self.rules = SpeechTurn(rate_hz, microphones.clock.now_ns())
        self._websocket = websocket
        self._microphones = microphones

    async def listen(self) -> None:
        """Publish the sound until the button is released.

        Raises:
            SpeechTurnRefused: a message is not accepted.
            WebSocketDisconnect: the connection was lost.
        """
        step = SoundStep.CUT
        try:
            while (data := await self._next()) is not None:
                samples = self.rules.take(data, self._microphones.clock.now_ns())
                self._microphones.publish(self, SoundStep.SOUND, samples)
            step = SoundStep.ENDED
        finally:
            self._microphones.publish(self, step)

    async def _next(self) -> bytes | None:
        """Return the next sound, None once the button is released."""
        message = await received(self._websocket)
        if message["type"] == "websocket.disconnect":
            code = message.get("code", 1005)
            if code not in RELEASED:
                raise WebSocketDisconnect(code)
            return None
        if (data := message.get("bytes")) is not None:
            return bytes(data)
        check_end(message.get("text") or "")
        return None


@router.websocket("/microphone")
async def microphone(websocket: WebSocket, who: Operator) -> None:
    """Take what a user says into the browser's microphone."""
    microphones: PageMicrophones = websocket.app.state.microphones
    await websocket.accept()
    try:
        await _speak(websocket, microphones, who.user)
        await _close(websocket, 1000, "")
    except SpeechTurnRefused as refusal:
        await _close(websocket, refusal.code, str(refusal))
    except WebSocketDisconnect:
        return  # the connection was lost, and the turn was cut


async def _speak(websocket: WebSocket, microphones: PageMicrophones, speaker: str) -> None:
    first = await received(websocket)
    if first["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(first.get("code", 1005))
    rate_hz = rate_in(first.get("text") or "")
    microphones.check_speech()
    microphones.floor.take(speaker)
    try:
        await websocket.send_json({"floor": "yours"})
        await TurnConnection(websocket, microphones, rate_hz).listen()
    finally:
        microphones.floor.leave()


async def received(websocket: WebSocket) -> Any:
    """Return the next event of a connection.

    Raises:
        SpeechTurnRefused: none came in time.
    """
    try:
        return await asyncio.wait_for(websocket.receive(), SILENT_S)
    except TimeoutError as error:
        what = f"no sound came for {SILENT_S:g} s; is the microphone allowed?"
        raise SpeechTurnRefused(4408, what) from error


async def _close(websocket: WebSocket, code: int, reason: str) -> None:
    try:
        await websocket.close(code, reason.encode()[:_LONGEST_REASON].decode(errors="ignore"))
    except (RuntimeError, WebSocketDisconnect):
        return  # the client has closed it already
