"""Read referring expressions: "the red cup" is a class and a colour, "the kitchen" a place."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vla_deploy.planning.catalogue import COLOURS, OBJECT_CLASSES
from vla_deploy.planning.errors import UnknownObject

ARTICLES = frozenset({"the", "a", "an", "my", "your", "that", "this", "some", "our"})
SYNONYMS: Mapping[str, str] = {
    "mug": "cup", "glass": "cup", "beaker": "cup", "tumbler": "cup",
    "sphere": "ball",
    "novel": "book", "notebook": "book",
    "flask": "bottle",
    "smartphone": "phone", "mobile": "phone", "telephone": "phone",
    "key": "keys", "keyring": "keys",
    "crate": "box", "bin": "box", "container": "box", "basket": "box",
    "thing": "object", "something": "object",
    "gray": "grey", "violet": "purple",
}  # fmt: skip
FILLERS = frozenset({"small", "big", "large", "little", "old", "new", "one", "storage"})
_TRACK_ID = re.compile(r"^(?P<kind>[a-z]+)_\d+$")


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectQuery:
    """Say which objects are meant; an empty colour means any."""

    kind: str
    colour: str = ""
    track_id: str = ""

    def matches(self, candidate: Mapping[str, Any]) -> bool:
        """Tell whether an object of the scene document is one of those meant."""
        if self.track_id:
            return bool(candidate["id"] == self.track_id)
        right_kind = self.kind in ("object", candidate["class"])
        return right_kind and self.colour in ("", candidate["colour"])

    def __str__(self) -> str:
        return self.track_id or f"{self.colour} {self.kind}".strip()


def words_of(text: str) -> list[str]:
    """Return lower-case words without articles and punctuation."""
    words = re.findall(r"[a-z0-9_]+", text.lower())
    return [word for word in words if word not in ARTICLES]


def parse_object(text: str) -> ObjectQuery:
    """Read "the red cup", "mug" or a track id such as "cup_1".

    Raises:
        UnknownObject: no word of it, or one word too many, is a kind or colour the robot knows.
    """
    track = _TRACK_ID.match(text.strip().lower())
    if track and track["kind"] in OBJECT_CLASSES:
        return ObjectQuery(kind=track["kind"], track_id=text.strip().lower())
    words = [SYNONYMS.get(word, word) for word in words_of(text) if word not in FILLERS]
    colours = [word for word in words if word in COLOURS]
    kinds = [word for word in words if word in OBJECT_CLASSES]
    understood = len(colours) + len(kinds) == len(words)
    if len(kinds) != 1 or len(colours) > 1 or not understood:
        raise UnknownObject(text.strip(), OBJECT_CLASSES)
    return ObjectQuery(kind=kinds[0], colour=colours[0] if colours else "")


def match_place(text: str, places: Mapping[str, str]) -> str | None:
    """Return the place that `text` names, or None; `places` maps every spoken name to a place."""
    spoken = " ".join(words_of(text.replace("_", " ")))
    return places.get(spoken)
