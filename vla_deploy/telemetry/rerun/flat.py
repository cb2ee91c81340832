"""Draw what is no place in space: images, lines of the logs, events."""

import base64
from collections.abc import Iterator
from typing import Final

from vla_deploy.ipc.rgbd_image import MILLIMETRE_M
from vla_deploy.telemetry.rerun.entity import LOGS, Entity, frame_path, part
from vla_deploy.telemetry.schemas.geometry import Json

_LEVELS: Final = ("INFO", "DEBUG", "INFO", "WARN", "ERROR", "CRITICAL")  # foxglove.Log
_PER_METRE: Final = round(1 / MILLIMETRE_M)


def colour(message: Json) -> Iterator[Entity]:
    """Yield what the camera sees."""
    values = {
        "contents": base64.b64decode(message["data"]),
        "media_type": f"image/{message['format']}",
    }
    path = f"{frame_path(message['frame_id'])}/colour"
    yield Entity(path=path, archetype="EncodedImage", values=values)


def depth(message: Json) -> Iterator[Entity]:
    """Yield how far it sees, which is shown as points before the camera."""
    values = {
        "blob": base64.b64decode(message["data"]),
        "media_type": f"image/{message['format']}",
        "meter": _PER_METRE,
    }
    path = f"{frame_path(message['frame_id'])}/depth"
    yield Entity(path=path, archetype="EncodedDepthImage", values=values)


def line(message: Json) -> Iterator[Entity]:
    """Yield a line of a process' log."""
    values = {"text": str(message["message"]), "level": _LEVELS[message["level"]]}
    path = f"{LOGS}/{part(message['name'])}"
    yield Entity(path=path, archetype="TextLog", values=values)


def event(topic: str, text: bytes) -> Iterator[Entity]:
    """Yield an event of a ring as it was told."""
    values = {"text": text.decode(), "level": "INFO"}
    yield Entity(path=f"{LOGS}/events/{topic}", archetype="TextLog", values=values)
