"""Turn JSON objects into bounded bytes and back."""

import json
from typing import Any

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.topics import Topic

_SHOWN_CHARACTERS = 80


def encode(document: object, topic: Topic[Any], limit_bytes: int) -> bytes:
    """Return compact UTF-8 JSON.

    Raises:
        BadPayload: not a JSON object, not serialisable, or longer than the topic's slot.
    """
    if not isinstance(document, dict):
        kind = type(document).__name__
        raise BadPayload(f"topic {topic.name}: expected a JSON object, got {kind}")
    try:
        text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        payload = text.encode()
    except (TypeError, ValueError) as error:
        raise BadPayload(f"topic {topic.name}: not JSON: {error}") from error
    if len(payload) > limit_bytes:
        raise BadPayload(
            f"topic {topic.name}: document of {len(payload)} bytes, limit {limit_bytes}; "
            f"it begins {text[:_SHOWN_CHARACTERS]!r}"
        )
    return payload


def decode(payload: bytes) -> Any:
    """Return the JSON object of a payload that its CRC has confirmed."""
    return json.loads(payload)
