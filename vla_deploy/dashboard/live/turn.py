"""Judge what a browser's microphone sends: the rules of one turn, and who has the floor.

One person at a time has the floor, from the first message of their connection to its end. A turn
ends well when the button is let go: by {"end": true}, or by closing the connection. It is cut off,
and the phrase under way is forgotten, when the connection is lost, and by each of these refusals:

    garbage    what is no sound: an odd number of bytes, text that is none of ours
    too_large  more than a second of sound in one message
    too_fast   sound that comes faster than anybody speaks: a second and a half ahead of time
    silent     nothing for three seconds: whoever holds the button sends silence, too
    too_long   a turn of more than half a minute: no command is that long
    taken      somebody else speaks (told to the one who came later)
    deaf       the robot's speech process does not run
"""

import json
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.ipc.page_sound import RATES_HZ, Samples

LARGEST_S: Final = 1.0
AHEAD_S: Final = 1.5
SILENT_S: Final = 3.0
LONGEST_S: Final = 30.0
SAMPLE_BYTES: Final = 2


class TurnRefused(Exception):
    """End a turn: a code of WebSocket's, a word, and what to tell the speaker."""

    def __init__(self, code: int, word: str, what: str) -> None:
        super().__init__(what)
        self.code = code
        self.word = word


@dataclass(slots=True)
class Turn:
    """Follow one turn that began at `began_ns`."""

    rate_hz: int
    began_ns: int
    samples: int = 0

    def take(self, data: bytes, now_ns: int) -> Samples:
        """Return the samples of a message.

        Raises:
            TurnRefused: it is no sound, or too much of it.
        """
        if len(data) % SAMPLE_BYTES:
            raise TurnRefused(1007, "garbage", f"{len(data)} bytes are no 16-bit samples")
        if len(data) > LARGEST_S * self.rate_hz * SAMPLE_BYTES:
            raise TurnRefused(1009, "too_large", "send at most a second of sound at once")
        samples = np.frombuffer(data, "<i2").astype(np.int16)
        self.samples += len(samples)
        spoken_s, passed_s = self.samples / self.rate_hz, (now_ns - self.began_ns) / NS_PER_S
        if spoken_s > passed_s + AHEAD_S:
            raise TurnRefused(4429, "too_fast", "sound comes faster than it can be spoken")
        if max(spoken_s, passed_s) > LONGEST_S:
            raise TurnRefused(4413, "too_long", f"nobody is heard for longer than {LONGEST_S:g} s")
        return samples


@dataclass(slots=True)
class Floor:
    """Know who speaks; one at a time."""

    holder: str | None = None

    def take(self, speaker: str) -> None:
        """Give the floor to a speaker.

        Raises:
            TurnRefused: another one has it.
        """
        if self.holder is not None:
            raise TurnRefused(4409, "taken", f"{self.holder} speaks to the robot; wait a moment")
        self.holder = speaker

    def leave(self) -> None:
        """Let the next one speak."""
        self.holder = None


def rate_in(text: str) -> int:
    """Return the rate that the first message of a turn declares.

    Raises:
        TurnRefused: it declares none that is taken.
    """
    rate_hz = _document(text).get("rate_hz")
    if isinstance(rate_hz, bool) or rate_hz not in RATES_HZ:
        listed = " or ".join(map(str, RATES_HZ))
        raise TurnRefused(1008, "garbage", f'expected {{"rate_hz": {listed}}}, got {text[:40]!r}')
    return int(rate_hz)


def check_end(text: str) -> None:
    """Take a text within a turn, which ends it.

    Raises:
        TurnRefused: it is another one.
    """
    if _document(text) != {"end": True}:
        raise TurnRefused(1008, "garbage", f'expected sound or {{"end": true}}, got {text[:40]!r}')


def _document(text: str) -> dict[str, Any]:
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}
