"""Turn recorded messages back into what the topics carry."""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

import cv2
import numpy as np

from vla_deploy.ipc import PackedField, Topic

_STAMP_SUFFIX: Final = "_ns"


def fields_of(topic: Topic, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the packed fields of a cell; what another version did not record is zero."""
    return {field.name: _value(field, document.get(field.name)) for field in topic.fields}


def shifted(document: Any, shift_ns: int) -> Any:
    """Return a document whose stamps of the recorded run's clock are moved into that of this one.

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
    """Return an image as the frame ring carries it, its width and its height.

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


def document_of(text: bytes) -> dict[str, Any]:
    """Return the JSON object of a message."""
    document: dict[str, Any] = json.loads(text)
    return document


def _value(field: PackedField, recorded: Any) -> Any:
    nothing = math.nan if field.dtype.startswith("f") else 0
    if field.shape == 1:
        return nothing if recorded is None else recorded
    values = recorded if isinstance(recorded, list) else []
    return [nothing if value is None else value for value in values][: field.shape]
