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
    """Number the kinds of binary messages."""

    CAMERA_JPEG = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class LookTime:
    """Hold one moment on the run's clock and on the wall clock."""

    run_ns: int
    wall_ns: int

    def wall_s(self, stamp_ns: int) -> float:
        """Return the wall time of a stamp of the run's clock."""
        return (self.wall_ns - self.run_ns + stamp_ns) / NS_PER_S

    def age_s(self, stamp_ns: int) -> float:
        """Return the age of a stamp of the run's clock."""
        return (self.run_ns - stamp_ns) / NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveMessage:
    """Hold a message of a topic as a WebSocket frame; a `queued` one is an event, never skipped."""

    topic: str
    frame: bytes
    queued: bool = False


def text_message(
    topic: str, stamp_ns: int, now: LookTime, data: bytes, *, queued: bool = False
) -> LiveMessage:
    """Return the message of data that is JSON text."""
    head = json.dumps(
        {
            "topic": topic,
            "stamp_s": round(now.wall_s(stamp_ns), 4),
            "age_s": round(now.age_s(stamp_ns), 4),
        }
    )
    payload = b"".join((head[:-1].encode(), b', "data": ', data, b"}"))
    return LiveMessage(topic=topic, frame=_frame(Opcode.TEXT, payload), queued=queued)


def json_message(
    topic: str, stamp_ns: int, now: LookTime, data: Any, *, queued: bool = False
) -> LiveMessage:
    """Return the message of data that is serialised here.

    Raises:
        ValueError: a number is not finite, which JSON cannot express.
    """
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text_message(topic, stamp_ns, now, text.encode(), queued=queued)


def binary_message(
    topic: str, kind: Binary, header: Mapping[str, Any], payload: bytes
) -> LiveMessage:
    """Return the message of bytes with a JSON header."""
    head = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    whole = b"".join((struct.pack("<BI", kind, len(head)), head, payload))
    return LiveMessage(topic=topic, frame=_frame(Opcode.BINARY, whole))


def lost_message(topic: str, count: int) -> LiveMessage:
    """Return the message that a client lost events of a topic."""
    text = json.dumps({"topic": "lost", "data": {"topic": topic, "count": count}})
    return LiveMessage(topic="lost", frame=_frame(Opcode.TEXT, text.encode()), queued=True)


def _frame(opcode: Opcode, payload: bytes) -> bytes:
    return Frame(opcode, payload).serialize(mask=False)


class LiveFeed(Protocol):
    """Make the messages of one live topic, only while a client is subscribed to it."""

    @property
    def topic(self) -> str:
        """Return the topic's name."""
        ...

    @property
    def period_s(self) -> float:
        """Return the shortest time between two looks."""
        ...

    def begin(self) -> None:
        """Forget the time without subscribers; the next look returns the newest value."""
        ...

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return what is new since the last look, without waiting."""
        ...
