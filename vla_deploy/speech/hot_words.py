"""Name what may be spoken of here: the things that the robot knows, and its places."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from vla_deploy.ipc import CellReader

MOST_WORDS: Final = 40


class HotWords:
    """Read the names from the scene whenever it has changed."""

    def __init__(self, places: Iterable[str], scene: CellReader) -> None:
        self._places = tuple(place.replace("_", " ") for place in places)
        self._scene = scene
        self._sequence = -1
        self._text = ", ".join(self._places)

    def text(self) -> str:
        """Return the names as a recogniser takes them: a line, the things first."""
        told = self._scene.latest()
        if told is not None and told.sequence != self._sequence:
            self._sequence = told.sequence
            self._text = joined((*thing_names(told.document()), *self._places))
        return self._text


def thing_names(scene: Mapping[str, Any]) -> tuple[str, ...]:
    """Return colour and class of the things of a scene, each pair once."""
    things = scene.get("objects", [])
    names = (f"{one.get('colour', '')} {one.get('class', '')}".strip() for one in things)
    return tuple(dict.fromkeys(name for name in names if name))


def joined(names: Iterable[str]) -> str:
    """Return names as one line, as many as fit."""
    kept: list[str] = []
    count = 0
    for name in names:
        count += len(name.split())
        if count > MOST_WORDS:
            break
        kept.append(name)
    return ", ".join(kept)
