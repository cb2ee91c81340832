"""Declare live topics and their messages: each message is serialised and framed once for all.

Text is one JSON object: {"topic", "stamp_s", "age_s", "data"}. Binary is one byte for the kind, the
length of a JSON header as a little-endian 32-bit number, the header, and the payload.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol

from websockets.frames import Frame, Opcode

from drivers.clock import NS_PER_S


class Binary(IntEnum):
    """Number what a binary message carries."""

    CAMERA_JPEG = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LookTime:
    """Say when somebody looks: on the run's clock, and by the wall."""

    run_ns: int
    wall_ns: int

    def wall_s(self, stamp_ns: int) -> float:
        """Return the wall time of a stamp of the run's clock."""
        return (self.wall_ns - self.run_ns + stamp_ns) / NS_PER_S

    def age_s(self, stamp_ns: int) -> float:
        """Return how long ago a stamp of the run's clock was."""
        return (self.run_ns - stamp_ns) / NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveMessage:
    """Hold a message of a topic; a `queued` one is an event, of which none is skipped.

    `frame` is the content as a WebSocket carries it to any client.
    """

    topic: str
    content: str | bytes
    frame: bytes
    queued: bool = False


def text_message(
    topic: str, stamp_ns: int, now: LookTime, data: bytes, *, queued: bool = False
) -> LiveMessage:
    """Wrap JSON text that is whole already."""
    head = json.dumps(
        {
            "topic": topic,
            "stamp_s": round(now.wall_s(stamp_ns), 4),
            "age_s": round(now.age_s(stamp_ns), 4),
        }
    )
    payload = b"".join((head[:-1].encode(), b', "data": ', data, b"}"))
    frame = _frame(Opcode.TEXT, payload)
    return LiveMessage(topic=topic, content=payload.decode(), frame=frame, queued=queued)


def json_message(
    topic: str, stamp_ns: int, now: LookTime, data: Any, *, queued: bool = False
) -> LiveMessage:
    """Wrap data that is no text yet.

    Raises:
        ValueError: a number is not finite: JSON has none such.
    """
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text_message(topic, stamp_ns, now, text.encode(), queued=queued)


def binary_message(
    topic: str, kind: Binary, header: Mapping[str, Any], payload: bytes
) -> LiveMessage:
    """Wrap bytes with their header."""
    head = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    whole = b"".join((struct.pack("<BI", kind, len(head)), head, payload))
    return LiveMessage(topic=topic, content=whole, frame=_frame(Opcode.BINARY, whole))


def lost_message(topic: str, count: int) -> LiveMessage:
    """Tell a client how many events of a topic it was too slow for."""
    text = json.dumps({"topic": "lost", "data": {"topic": topic, "count": count}})
    frame = _frame(Opcode.TEXT, text.encode())
    return LiveMessage(topic="lost", content=text, frame=frame, queued=True)


def _frame(opcode: Opcode, payload: bytes) -> bytes:
    return Frame(opcode, payload).serialize(mask=False)


class LiveFeed(Protocol):
    """Look at one live topic; only while somebody is subscribed to it."""

    @property
    def topic(self) -> str:
        """Return its name."""
        ...

    @property
    def period_s(self) -> float:
        """Return the least time between two looks."""
        ...

    def begin(self) -> None:
        """Forget what happened while nobody was subscribed; the next look gives what is newest."""
        ...

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return what is new since the last look; quick, and never waiting for anybody."""
        ...
