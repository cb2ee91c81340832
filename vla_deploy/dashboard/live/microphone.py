"""Take sound from a browser's microphone for the speech process: WebSocket `/microphone`.

A client sends {"rate_hz": 16000} or 48000, receives {"floor": "yours"}, and then sends PCM, 16 bit,
little-endian, one channel. One user at a time has the floor, from the first message to the end of
the connection. A turn ends well when the button is released: by {"end": true}, or by closing the
connection. It is cut, and the current phrase is dropped, when the connection is lost, and by each
of these refusals, whose text is the reason of the close frame:

    garbage    no sound: an odd number of bytes, or unknown text
    too_large  more than a second of sound in one message
    too_fast   sound that is 1.5 s ahead of real time
    silent     no message for 3 s: a held button sends silence, too
    too_long   more than 30 s: no command is that long
    taken      another user speaks
    deaf       the speech process does not run
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
from vla_deploy.ipc import RecordWriter
from vla_deploy.ipc.page_sound import NOTHING, RATES_HZ, PageSound, Samples, Step

LARGEST_S: Final = 1.0
AHEAD_S: Final = 1.5
SILENT_S: Final = 3.0
LONGEST_S: Final = 30.0
SAMPLE_BYTES: Final = 2


class SpeechTurnRefused(Exception):
    """End a turn: a code of WebSocket's, a word, and what to tell the speaker."""

    def __init__(self, code: int, word: str, what: str) -> None:
        super().__init__(what)
        self.code = code
        self.word = word


@dataclass(slots=True)
class SpeechTurn:
    """Follow one turn that began at `began_ns`."""

    rate_hz: int
    began_ns: int
    samples: int = 0

    def take(self, data: bytes, now_ns: int) -> Samples:
        """Return the samples of a message.

        Raises:
            SpeechTurnRefused: it is no sound, or too much of it.
        """
        if len(data) % SAMPLE_BYTES:
            raise SpeechTurnRefused(1007, "garbage", f"{len(data)} bytes are no 16-bit samples")
        if len(data) > LARGEST_S * self.rate_hz * SAMPLE_BYTES:
            raise SpeechTurnRefused(1009, "too_large", "send at most a second of sound at once")
        samples = np.frombuffer(data, "<i2").astype(np.int16)
        self.samples += len(samples)
        spoken_s, passed_s = self.samples / self.rate_hz, (now_ns - self.began_ns) / NS_PER_S
        if spoken_s > passed_s + AHEAD_S:
            raise SpeechTurnRefused(4429, "too_fast", "sound comes faster than it can be spoken")
        if max(spoken_s, passed_s) > LONGEST_S:
            raise SpeechTurnRefused(
                4413, "too_long", f"nobody is heard for longer than {LONGEST_S:g} s"
            )
        return samples


@dataclass(slots=True)
class Floor:
    """Know who speaks; one at a time."""

    holder: str | None = None

    def take(self, speaker: str) -> None:
        """Give the floor to a speaker.

        Raises:
            SpeechTurnRefused: another one has it.
        """
        if self.holder is not None:
            raise SpeechTurnRefused(
                4409, "taken", f"{self.holder} speaks to the robot; wait a moment"
            )
        self.holder = speaker

    def leave(self) -> None:
        """Let the next one speak."""
        self.holder = None


def rate_in(text: str) -> int:
    """Return the rate that the first message of a turn declares.

    Raises:
        SpeechTurnRefused: it declares none that is taken.
    """
    rate_hz = _document(text).get("rate_hz")
    if isinstance(rate_hz, bool) or rate_hz not in RATES_HZ:
        listed = " or ".join(map(str, RATES_HZ))
        raise SpeechTurnRefused(
            1008, "garbage", f'expected {{"rate_hz": {listed}}}, got {text[:40]!r}'
        )
    return int(rate_hz)


def check_end(text: str) -> None:
    """Take a text within a turn, which ends it.

    Raises:
        SpeechTurnRefused: it is another one.
    """
    if _document(text) != {"end": True}:
        raise SpeechTurnRefused(
            1008, "garbage", f'expected sound or {{"end": true}}, got {text[:40]!r}'
        )


def _document(text: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


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
            SpeechTurnRefused: the speech process does not run.
        """
        if self._link.fresh("speech_status", _EARS_S) is None:
            raise SpeechTurnRefused(1013, "deaf", "the robot's speech process does not run")

    def hand_on(self, turn: "TurnConnection", step: Step, samples: Samples = NOTHING) -> None:
        """Give a step of a turn to the speech process."""
        rate_hz = turn.rules.rate_hz
        sound = PageSound(turn=turn.number, rate_hz=rate_hz, step=step, samples=samples)
        self._records.append(sound.packed())


class TurnConnection:
    """Carry one turn over its connection."""

    def __init__(self, websocket: WebSocket, microphones: PageMicrophones, rate_hz: int) -> None:
        self.number = secrets.randbits(32)
        self.rules = SpeechTurn(rate_hz, microphones.clock.now_ns())
        self._websocket = websocket
        self._microphones = microphones

    async def listen(self) -> None:
        """Hand on what comes until the button is let go.

        Raises:
            SpeechTurnRefused: what came is not taken.
            WebSocketDisconnect: the connection was lost.
        """
        step = Step.CUT
        try:
            while (data := await self._next()) is not None:
                samples = self.rules.take(data, self._microphones.clock.now_ns())
                self._microphones.hand_on(self, Step.SOUND, samples)
            step = Step.ENDED
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
    except SpeechTurnRefused as refusal:
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
        await TurnConnection(websocket, microphones, rate_hz).listen()
    finally:
        microphones.floor.leave()


async def received(websocket: WebSocket) -> Any:
    """Return the next event of a connection.

    Raises:
        SpeechTurnRefused: none came for too long.
    """
    try:
        return await asyncio.wait_for(websocket.receive(), SILENT_S)
    except TimeoutError as error:
        what = f"no sound came for {SILENT_S:g} s; is the microphone allowed?"
        raise SpeechTurnRefused(4408, "silent", what) from error


async def _close(websocket: WebSocket, code: int, reason: str) -> None:
    try:
        await websocket.close(code, reason.encode()[:_LONGEST_REASON].decode(errors="ignore"))
    except (RuntimeError, WebSocketDisconnect):
        return  # the client has closed it already
