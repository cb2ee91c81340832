"""Derive channels, their JSON schemas and JSON texts, from the one table of topics."""

import base64
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vla_deploy.ipc import BY_NAME, TOPICS, PackedField, Topic, TopicKind
from vla_deploy.ipc.memory.layout import is_document, record_dtype
from vla_deploy.telemetry.schemas.foxglove_json import CAMERA, foxglove_schema, time_json

TICKS: Final = "tick_record"
IMAGE_SCHEMA: Final = "foxglove.CompressedImage"
_IMAGE_FORMS: Final[Mapping[str, str]] = {"colour": "jpeg", "depth": "png"}
_BYTES = {"type": "string", "contentEncoding": "base64"}
_TICK = {
    "tick": {"type": "integer", "description": "number of the tick since control started"},
    "writer_pid": {"type": "integer", "description": "pid of control"},
    "cause": {"type": "string"},
    "reaction": {"type": "string"},
    "record": {**_BYTES, "description": "vla_deploy.ipc.memory.delta, exact to the bit"},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """Describe one channel of a file."""

    topic: str
    schema_name: str
    schema: Mapping[str, Any]

    @property
    def schema_text(self) -> bytes:
        """Return the JSON schema as bytes."""
        return json.dumps(self.schema).encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicValue:
    """Carry one value: the JSON or the packed bytes of its topic, or a compressed image."""

    stamp_ns: int
    sequence: int
    payload: bytes


ChannelValue = tuple[str, TopicValue]
"""The name of a channel, and a value of it."""


def channels_of(topic: Topic[Any]) -> tuple[Channel, ...]:
    """Return the channels of a topic: one, two for images, none for a private topic."""
    if topic.private:
        return ()
    if topic.kind is TopicKind.FRAME:
        return tuple(
            Channel(
                topic=f"{topic.name}/{part}",
                schema_name=IMAGE_SCHEMA,
                schema=foxglove_schema(IMAGE_SCHEMA),
            )
            for part in _IMAGE_FORMS
        )
    schema = {"type": "object", **_content(topic), "description": topic.summary}
    return (Channel(topic=topic.name, schema_name=f"vla_deploy.{topic.name}", schema=schema),)


def value_text(channel: str, value: TopicValue, wall_offset_ns: int) -> bytes:
    """Return a value of any topic as JSON; an image is compressed, on the channel of its part."""
    topic, _, part = channel.partition("/")
    if part:
        return image_text(value.stamp_ns + wall_offset_ns, value.payload, _IMAGE_FORMS[part])
    is_cell = BY_NAME[topic].kind is TopicKind.CELL
    return cell_text(BY_NAME[topic], value.payload) if is_cell else value.payload


def cell_text(topic: Topic[Any], payload: bytes) -> bytes:
    """Return a cell's value as JSON; NaN and infinities become null."""
    if is_document(topic):
        return payload
    record = np.frombuffer(payload, record_dtype(topic))[0]
    return json.dumps({field.name: _plain(record[field.name]) for field in topic.fields}).encode()


def image_text(stamp_ns: int, data: bytes, form: str) -> bytes:
    """Return a compressed image of the camera as `foxglove.CompressedImage`."""
    return json.dumps(
        {
            "timestamp": time_json(stamp_ns),
            "frame_id": CAMERA,
            "data": base64.b64encode(data).decode(),
            "format": form,
        }
    ).encode()


def tick_text(row: Mapping[str, Any] | None, record: bytes, writer_pid: int) -> bytes:
    """Return a tick's record as JSON, with number, cause and reaction for people."""
    shown = {}
    if row is not None:
        verdict = row["verdict"]
        shown = {
            "tick": row["tick"],
            "cause": verdict.cause.value,
            "reaction": verdict.reaction.name,
        }
    document = {**shown, "writer_pid": writer_pid, "record": base64.b64encode(record).decode()}
    return json.dumps(document).encode()


def tick_bytes(text: bytes) -> bytes:
    """Return the record that `tick_text` carried."""
    return base64.b64decode(json.loads(text)["record"])


def _content(topic: Topic[Any]) -> dict[str, Any]:
    """Return the schema of a message; documents are described in docs/architecture.md."""
    if topic.kind is TopicKind.RECORD:
        return {"properties": _TICK, "required": ["record"]}
    if topic.kind is TopicKind.CELL and not is_document(topic):
        properties = {field.name: _property(field) for field in topic.fields}
        required = [field.name for field in topic.fields if not field.may_lack]
        return {"properties": properties, "required": required}
    return {}


def _property(field: PackedField) -> dict[str, Any]:
    kind = ["number", "null"] if field.dtype.startswith("f") else "integer"
    number = {"type": kind, "description": field.unit}
    if field.shape == 1:
        return number
    return {"type": "array", "items": number, "minItems": field.shape, "maxItems": field.shape}


def _plain(value: Any) -> Any:
    plain = value.tolist()
    numbers = plain if isinstance(plain, list) else [plain]
    finite = [number if math.isfinite(number) else None for number in numbers]
    return finite if isinstance(plain, list) else finite[0]


TOPIC_CHANNELS: Final[tuple[Channel, ...]] = tuple(
    channel for topic in TOPICS for channel in channels_of(topic)
)
"""The channels of every topic of the schema table."""
