"""Put recorded messages into the topics of a run directory."""

import base64
import json
import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import BY_NAME, BadPayload, SharedSpace, Topic, TopicKind
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.ipc.replay_mark import LIVE_OWNERS
from vla_deploy.telemetry.channels import tick_bytes
from vla_deploy.telemetry.recording.batch import LOG_CHANNEL
from vla_deploy.telemetry.replay.decoding import (
    document_of,
    fields_of,
    image_payload,
    shifted,
)
from vla_deploy.telemetry.replay.source import Recorded

_OWN: Final = frozenset({"replay_request", "replay_status"})
_LEVELS: Final = ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")
_LOOK_NS: Final = NS_PER_S // 10  # a recorder looks that seldom, at the most
_IMAGE_PARTS: Final = ("colour", "depth")
LASTING: Final = (TopicKind.CELL, TopicKind.FRAME)
"""Topics whose value is so until the next one comes."""
_log = logging.getLogger(__name__)


def fed_topics() -> tuple[Topic, ...]:
    """Return the topics that a file may speak for: not those of processes that run now."""
    return tuple(
        topic
        for topic in BY_NAME.values()
        if topic.owner not in LIVE_OWNERS and topic.name not in _OWN
    )


class Feeder:
    """Write what was recorded, as fresh as it was then; `unfit` counts what does not fit."""

    def __init__(self, space: SharedSpace, logs: Path, clock: Clock) -> None:
        self.unfit = 0
        self._space = space
        self._logs = logs
        self._clock = clock
        self._topics = {topic.name: topic for topic in fed_topics()}
        self._puts: dict[str, Callable[[Recorded], None]] = {}
        self._images: dict[str, tuple[int, dict[str, bytes]]] = {}
        self._lasting: dict[str, Recorded] = {}
        logs.mkdir(parents=True, exist_ok=True)

    def hold(self, at_ns: int) -> None:
        """Show what was in time at a moment of the file as in time again: the file stands there."""
        for message in tuple(self._lasting.values()):
            deadline_s = self._topics[message.channel.partition("/")[0]].deadline_s
            allowed_ns = deadline_s * NS_PER_S + _LOOK_NS
            if not deadline_s or at_ns - message.at_ns <= allowed_ns:
                self.feed(message)

    def feed(self, message: Recorded) -> None:
        """Put one message into its topic; what no longer fits the topic is left out, counted."""
        topic, _, _ = message.channel.partition("/")
        if topic in self._topics and self._topics[topic].kind in LASTING:
            self._lasting[message.channel] = message
        try:
            if message.channel == LOG_CHANNEL:
                self._log_line(message)
            elif topic in self._topics:
                self._put_of(topic)(message)
        except (BadPayload, ValueError, KeyError, TypeError) as error:
            if not self.unfit:
                _log.warning("%s: left out: %s", message.channel, error)
            self.unfit += 1

    def _put_of(self, name: str) -> Callable[[Recorded], None]:
        if name not in self._puts:
            topic = self._topics[name]
            kind = topic.kind
            is_packed = kind is TopicKind.CELL and not is_document(topic)
            self._puts[name] = self._packed(topic) if is_packed else _OPENERS[kind](self, name)
        return self._puts[name]

    def _packed(self, topic: Topic) -> Callable[[Recorded], None]:
        writer = self._space.cell_writer(topic.name)
        return lambda message: writer.put(**fields_of(topic, document_of(message.text)))

    def _document(self, name: str) -> Callable[[Recorded], None]:
        writer = self._space.cell_writer(name)
        return lambda message: writer.put_document(self._shifted(message))

    def _event(self, name: str) -> Callable[[Recorded], None]:
        writer = self._space.ring_writer(name)

        def publish(message: Recorded) -> None:
            writer.publish(self._shifted(message))

        return publish

    def _record(self, name: str) -> Callable[[Recorded], None]:
        writer = self._space.record_writer(name)
        return lambda message: writer.append(tick_bytes(message.text))

    def _frame(self, name: str) -> Callable[[Recorded], None]:
        writer = self._space.frame_writer(name)

        def put(message: Recorded) -> None:
            sequence, parts = self._images.get(name, (-1, {}))
            parts = parts if sequence == message.sequence else {}
            data = base64.b64decode(document_of(message.text)["data"])
            parts[message.channel.partition("/")[2]] = data
            self._images[name] = message.sequence, parts
            if all(part in parts for part in _IMAGE_PARTS):
                payload, width, height = image_payload(parts["colour"], parts["depth"])
                now_ns = self._clock.now_ns()
                writer.put(payload, width=width, height=height, stamp_ns=now_ns)

        return put

    def _shifted(self, message: Recorded) -> dict[str, Any]:
        shift_ns = self._clock.now_ns() - message.stamp_ns
        moved: dict[str, Any] = shifted(document_of(message.text), shift_ns)
        return moved

    def _log_line(self, message: Recorded) -> None:
        """Write a line where `vla-deploy logs` and the dashboard look for it."""
        line = document_of(message.text)
        at_s = line["timestamp"]["sec"] + line["timestamp"]["nsec"] / NS_PER_S
        written = {
            "stamp_ns": self._clock.now_ns(),
            "time": datetime.fromtimestamp(at_s, UTC).isoformat(timespec="milliseconds"),
            "level": _LEVELS[line["level"]],
            "process": line["name"],
            "message": line["message"],
            "file": line["file"],
            "line": line["line"],
        }
        name = "".join(letter for letter in line["name"] if letter.isalnum() or letter == "_")
        if name not in LIVE_OWNERS:
            with (self._logs / f"{name or 'unknown'}.log").open("a", encoding="utf-8") as log:
                log.write(json.dumps(written) + "\n")


_OPENERS: Final[Mapping[TopicKind, Callable[[Feeder, str], Callable[[Recorded], None]]]] = {
    TopicKind.CELL: Feeder._document,
    TopicKind.RING: Feeder._event,
    TopicKind.RECORD: Feeder._record,
    TopicKind.FRAME: Feeder._frame,
}
