"""Read what an action calls a thing, for the judge alone: "nearest small cup on coffee table".

The grammar is that of docs/world-model.md. It is written down here a second time, so that a fault
in the robot's own reading shows as a goal that is not reached instead of being judged right.
"""

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from benchmarks.planner_flat import FlatThing

KINDS: Final = frozenset(
    {"cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote"}
)
COLOURS: Final = frozenset(
    {"red", "orange", "yellow", "green", "blue", "purple", "pink", "brown", "white", "grey",
     "black"}
)  # fmt: skip
SAME: Final[Mapping[str, str]] = MappingProxyType({
    "mug": "cup", "glass": "cup", "beaker": "cup", "tumbler": "cup", "sphere": "ball",
    "novel": "book", "notebook": "book", "flask": "bottle", "smartphone": "phone",
    "mobile": "phone", "telephone": "phone", "key": "keys", "keyring": "keys",
    "controller": "remote", "zapper": "remote", "crate": "box", "bin": "box",
    "container": "box", "basket": "box", "thing": "object", "something": "object",
    "gray": "grey", "violet": "purple", "little": "small", "big": "large", "closest": "nearest",
})  # fmt: skip
SILENT: Final = frozenset(
    {"the", "a", "an", "my", "your", "that", "this", "some", "our", "old", "new", "one", "storage"}
)
RELATIONS: Final = (
    ("on top of", "on"), ("inside of", "in"), ("next to", "beside"), ("close to", "near"),
    ("inside", "in"), ("beside", "beside"), ("near", "near"), ("in", "in"), ("on", "on"),
)  # fmt: skip
NEAR_M: Final = 0.5
BESIDE_GAP_M: Final = 0.15
_ID: Final = re.compile(r"[a-z]+_\d+")


class Unread(Exception):
    """Say that an action names its thing in a way that means nothing."""


FORMS: Final[Mapping[str, Callable[[tuple[float, float, float]], bool]]] = MappingProxyType(
    {
        "tall": lambda size_m: size_m[2] > 1.5 * max(size_m[:2]),
        "flat": lambda size_m: size_m[2] < 0.4 * min(size_m[:2]),
        "long": lambda size_m: max(size_m[:2]) > 2.0 * min(size_m[:2]),
    }
)


def meant(
    text: str, things: Sequence[FlatThing], here: tuple[float, float], furniture: Mapping[str, str]
) -> list[FlatThing]:
    """Return the things that a text may mean, the nearest to `here` first.

    `furniture` maps spoken names to surfaces.

    Raises:
        Unread: a word of it means nothing.
    """
    own, relation, anchor = _split(" ".join(re.findall(r"[a-z0-9_]+", text.lower())))
    words = [SAME.get(word, word) for word in own.split() if word not in SILENT]
    if not words:
        raise Unread(f'"{text}" names nothing')
    found = _of_words(words, things, here)
    if relation:
        found = [one for one in found if _stands(one, relation, anchor, things, here, furniture)]
    return found


def _of_words(
    words: Collection[str], things: Sequence[FlatThing], here: tuple[float, float]
) -> list[FlatThing]:
    found = sorted(things, key=lambda one: math.dist(one.xy_m, here))
    for word in words:
        if _ID.fullmatch(word):
            found = [one for one in found if one.thing_id == word]
        elif word in KINDS:
            found = [one for one in found if one.kind == word]
        elif word in COLOURS:
            found = [one for one in found if one.colour == word]
        elif word in FORMS:
            found = [one for one in found if FORMS[word](one.size_m)]
        elif word not in ("object", "small", "large", "nearest", "farthest"):
            raise Unread(f'"{word}" is no word for things')
    # What compares comes last: "the small red cup" is the smaller of the red ones.
    if "small" in words or "large" in words:
        found = _compared(found, -1.0 if "small" in words else 1.0)
    if "nearest" in words:
        return found[:1]
    return found[-1:] if "farthest" in words else found


def _compared(things: list[FlatThing], sign: float) -> list[FlatThing]:
    if len(things) < 2:
        return things
    sizes = {one.thing_id: math.prod(one.size_m) ** (1 / 3) for one in things}
    middle = 0.5 * (min(sizes.values()) + max(sizes.values()))
    return [one for one in things if sign * (sizes[one.thing_id] - middle) >= 0.0]


def _split(text: str) -> tuple[str, str, str]:
    """Return the words before the first relation, the relation, and what stands behind it."""
    cuts = [
        (found.start(), -len(phrase), relation, found.end())
        for phrase, relation in RELATIONS
        if (found := re.search(rf"\b{phrase}\b", text))
    ]
    if not cuts:
        return text, "", ""
    start, _, relation, end = min(cuts)
    return text[:start], relation, text[end:].strip()


def _stands(
    one: FlatThing,
    relation: str,
    anchor: str,
    things: Sequence[FlatThing],
    here: tuple[float, float],
    furniture: Mapping[str, str],
) -> bool:
    surface = furniture.get(" ".join(word for word in anchor.split() if word not in SILENT))
    if surface:
        return relation in ("on", "near") and one.rests == ("on", surface)
    others = [other for other in meant(anchor, things, here, furniture) if other is not one]
    if relation == "near":
        return any(math.dist(one.xy_m, other.xy_m) <= NEAR_M for other in others)
    if relation == "beside":
        return any(_gap_m(one, other) < BESIDE_GAP_M for other in others)
    return one.rests in [(relation, other.thing_id) for other in others]


def _gap_m(one: FlatThing, other: FlatThing) -> float:
    """Return how far apart two things are that lie along the map's axes."""
    sides = zip(one.xy_m, other.xy_m, one.size_m[:2], other.size_m[:2], strict=True)
    return math.hypot(*(max(0.0, abs(a - b) - 0.5 * (la + lb)) for a, b, la, lb in sides))
