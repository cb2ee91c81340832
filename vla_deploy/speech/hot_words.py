"""Name what may be spoken of here: the things that the robot knows, and its places."""

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from itertools import accumulate, islice
from typing import Any, Final

from vla_deploy.ipc import CellReader

MOST_WORDS: Final = 40


class HotWords:
    """Read the names from the scene whenever it has changed."""

    def __init__(self, places: Iterable[str], scene: CellReader) -> None:
        self._places = tuple(place.replace("_", " ") for place in places)
        self._scene = scene
        self._sequence = -1
        self._text = hot_words_of({}, self._places)

    def text(self) -> str:
        """Return the names as a recogniser takes them: a line, the things first."""
        told = self._scene.latest()
        if told is not None and told.sequence != self._sequence:
            self._sequence = told.sequence
            self._text = hot_words_of(told.document(), self._places)
        return self._text


def hot_words_of(scene: Mapping[str, Any], places: Iterable[str]) -> str:
    """Return colour and class of the things of a scene, then places, as many as fit in a line."""
    things = (f"{one.get('colour', '')} {one.get('class', '')}" for one in scene.get("objects", []))
    names = dict.fromkeys(filter(None, map(str.strip, (*things, *places))))
    counts = list(accumulate(len(name.split()) for name in names))
    return ", ".join(islice(names, bisect_right(counts, MOST_WORDS)))
