"""Put recorded messages into the topics of a run directory."""

import base64
import json
import logging
import math
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import (
    BY_NAME,
    BadPayload,
    FrameWriter,
    PackedField,
    SharedSpace,
    Topic,
    TopicKind,
)
from vla_deploy.ipc.memory.layout import is_document
from vla_deploy.ipc.replay_mark import LIVE_OWNERS
from vla_deploy.telemetry.channels import tick_bytes
from vla_deploy.telemetry.recorded_file import RecordedMessage
from vla_deploy.telemetry.schemas.foxglove_json import LOG_LEVELS
from vla_deploy.telemetry.schemas.views import LOG

_OWN: Final = frozenset({"replay_request", "replay_status"})
_READ_PERIOD_NS: Final = NS_PER_S // 10  # of a recorder, at most
_STAMP_SUFFIX: Final = "_ns"
_IMAGE_PARTS: Final = ("colour", "depth")
LASTING: Final = (TopicKind.CELL, TopicKind.FRAME)
"""Topics whose value is valid until the next one."""
_log = logging.getLogger(__name__)


def fed_topics() -> tuple[Topic[Any], ...]:
    """Return the topics to be fed from a file: not those of processes that run now."""
    return tuple(
        topic
        for topic in BY_NAME.values()
        if topic.owner not in LIVE_OWNERS and topic.name not in _OWN
    )


class TopicFeeder:
    """Write recorded messages as new values; `unfit` counts those that do not fit their topic."""

    def __init__(self, space: SharedSpace, logs: Path, clock: Clock) -> None:
        self.unfit = 0
        self._space = space
        self._logs = logs
        self._clock = clock
        self._topics = {topic.name: topic for topic in fed_topics()}
        self._writers: dict[str, Any] = {}
        self._images: dict[str, tuple[int, dict[str, bytes]]] = {}
        self._lasting: dict[str, RecordedMessage] = {}
        logs.mkdir(parents=True, exist_ok=True)

    def hold(self, at_ns: int) -> None:
        """Write again what was fresh at a moment of the file, while the replay stands there."""
        for message in tuple(self._lasting.values()):
            deadline_s = self._topics[message.channel.partition("/")[0]].deadline_s
            allowed_ns = deadline_s * NS_PER_S + _READ_PERIOD_NS
            if not deadline_s or at_ns - message.at_ns <= allowed_ns:
                self.feed(message)

    def feed(self, message: RecordedMessage) -> None:
        """Put one message into its topic; one that does not fit is left out and counted."""
        topic, _, _ = message.channel.partition("/")
        if topic in self._topics and self._topics[topic].kind in LASTING:
            self._lasting[message.channel] = message
        try:
            if message.channel == LOG:
                self._log_line(message)
            elif topic in self._topics:
                self._put(self._topics[topic], message)
        except (BadPayload, ValueError, KeyError, TypeError) as error:
            if not self.unfit:
                _log.warning("%s: left out: %s", message.channel, error)
            self.unfit += 1

    def _put(self, topic: Topic[Any], message: RecordedMessage) -> None:
        writer = self._writer(topic)
        match topic.kind:
            case TopicKind.CELL if is_document(topic):
                writer.put_document(self._shifted(message))
            case TopicKind.CELL:
                writer.put(**fields_of(topic, message.document()))
            case TopicKind.RING:
                writer.publish(self._shifted(message))
            case TopicKind.RECORD:
                writer.append(tick_bytes(message.text))
            case TopicKind.FRAME:
                self._put_image(topic.name, writer, message)

    def _writer(self, topic: Topic[Any]) -> Any:
        """Return the writer of a topic, opened when first needed."""
        if topic.name not in self._writers:
            openers: Mapping[TopicKind, Callable[[str], Any]] = {
                TopicKind.CELL: self._space.cell_writer,
                TopicKind.RING: self._space.ring_writer,
                TopicKind.RECORD: self._space.record_writer,
                TopicKind.FRAME: self._space.frame_writer,
            }
            self._writers[topic.name] = openers[topic.kind](topic.name)
        return self._writers[topic.name]

    def _put_image(self, name: str, writer: FrameWriter, message: RecordedMessage) -> None:
        """Keep one part of an image, and put the image once it is complete."""
        sequence, parts = self._images.get(name, (-1, {}))
        parts = parts if sequence == message.sequence else {}
        parts[message.channel.partition("/")[2]] = base64.b64decode(message.document()["data"])
        self._images[name] = message.sequence, parts
        if all(part in parts for part in _IMAGE_PARTS):
            payload, width, height = image_payload(parts["colour"], parts["depth"])
            now_ns = self._clock.now_ns()
            writer.put(payload, width=width, height=height, stamp_ns=now_ns)

    def _shifted(self, message: RecordedMessage) -> dict[str, Any]:
        shift_ns = self._clock.now_ns() - message.stamp_ns
        moved: dict[str, Any] = shifted(message.document(), shift_ns)
        return moved

    def _log_line(self, message: RecordedMessage) -> None:
        """Write a line to the log files that `vla-deploy logs` and the dashboard read."""
        line = message.document()
        at_s = line["timestamp"]["sec"] + line["timestamp"]["nsec"] / NS_PER_S
        written = {
            "stamp_ns": self._clock.now_ns(),
            "time": datetime.fromtimestamp(at_s, UTC).isoformat(timespec="milliseconds"),
            "level": LOG_LEVELS[line["level"]],
            "process": line["name"],
            "message": line["message"],
            "file": line["file"],
            "line": line["line"],
        }
        name = "".join(letter for letter in line["name"] if letter.isalnum() or letter == "_")
        if name not in LIVE_OWNERS:
            with (self._logs / f"{name or 'unknown'}.log").open("a", encoding="utf-8") as log:
                log.write(json.dumps(written) + "\n")


def fields_of(topic: Topic[Any], document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a packed cell; what another version did not record is zero."""
    return {
        field.name: _value(field, document.get(field.name))
        for field in topic.fields
        if field.name in document or not field.may_lack
    }


def shifted(document: Any, shift_ns: int) -> Any:
    """Return a document with its stamps moved from the recorded run's clock into this one's.

    By the naming rule of all topics, a stamp is a whole number whose name ends in `_ns`.
    """
    if isinstance(document, dict):
        return {
            key: value + shift_ns
            if key.endswith(_STAMP_SUFFIX) and type(value) is int and value > 0
            else shifted(value, shift_ns)
            for key, value in document.items()
        }
    if isinstance(document, list):
        return [shifted(one, shift_ns) for one in document]
    return document


def image_payload(colour: bytes, depth: bytes) -> tuple[bytes, int, int]:
    """Return an image's payload for the frame ring, its width and its height.

    Raises:
        ValueError: the parts are no JPEG and 16-bit PNG of one size.
    """
    pixels = cv2.imdecode(np.frombuffer(colour, np.uint8), cv2.IMREAD_COLOR)
    depths = cv2.imdecode(np.frombuffer(depth, np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or depths is None or depths.shape != pixels.shape[:2]:
        raise ValueError("an image whose colour and depth do not belong together")
    height, width = depths.shape
    rgb = np.ascontiguousarray(pixels[..., ::-1])
    return rgb.tobytes() + depths.astype("<u2").tobytes(), width, height


def _value(field: PackedField, recorded: Any) -> Any:
    nothing = math.nan if field.dtype.startswith("f") else 0
    if field.shape == 1:
        return nothing if recorded is None else recorded
    values = recorded if isinstance(recorded, list) else []
    return [nothing if value is None else value for value in values][: field.shape]
