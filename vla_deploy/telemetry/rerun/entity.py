"""Describe entities for Rerun as plain data: path, archetype and values."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from vla_deploy.telemetry.schemas.foxglove_json import BASE, CAMERA, MAP, ODOM

WORLD: Final = "world"
PLOTS: Final = "plots"
LOGS: Final = "logs"
_ODD_LETTERS: Final = re.compile(r"[^A-Za-z0-9_-]")
_FRAMES: Final[Mapping[str, str]] = {
    MAP: WORLD,
    BASE: f"{WORLD}/base",
    CAMERA: f"{WORLD}/base/camera",
    ODOM: "odom",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """Name an archetype and its arguments; a `static` entity holds at every time."""

    path: str
    archetype: str
    values: Mapping[str, Any]
    static: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnMessage:
    """Carry the entities of one message, and its tick of control where it has one."""

    entities: tuple[Entity, ...]
    tick: int | None = None


def frame_path(frame: str) -> str:
    """Return the path of a frame that is known by name.

    Raises:
        ValueError: it is not.
    """
    if frame not in _FRAMES:
        raise ValueError(f"frame {frame!r}, expected one of {', '.join(_FRAMES)}")
    return _FRAMES[frame]


def child_path(parent: str, child: str) -> str:
    """Return the path of a frame that a transform places in a known one.

    Raises:
        ValueError: the parent is not known by name.
    """
    return _FRAMES.get(child) or f"{frame_path(parent)}/{path_part(child)}"


def path_part(name: str) -> str:
    """Return a name as one part of a path."""
    return _ODD_LETTERS.sub("_", name) or "unknown"
