"""List the words for things: kinds and colours with their synonyms, distance, size and form."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from vla_deploy.world.thing import Thing

OBJECT_CLASSES: Final = (
    "cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote", "block",
    "object",
)  # fmt: skip
ANY_CLASS: Final = "object"
COLOURS: Final = (
    "red", "orange", "yellow", "green", "blue", "purple", "pink", "brown", "white", "grey", "black",
)  # fmt: skip
# What may have other things in it.
CONTAINERS: Final = frozenset({"box", "bowl"})
ARTICLES: Final = frozenset({"the", "a", "an", "my", "your", "that", "this", "some", "our"})
SYNONYMS: Final[Mapping[str, str]] = MappingProxyType({
    "mug": "cup", "glass": "cup", "beaker": "cup", "tumbler": "cup", "teacup": "cup",
    "sphere": "ball",
    "novel": "book", "notebook": "book", "paperback": "book", "textbook": "book",
    "flask": "bottle",
    "smartphone": "phone", "mobile": "phone", "telephone": "phone", "cellphone": "phone",
    "cell": "phone",
    "tin": "can",
    "key": "keys", "keyring": "keys",
    "controller": "remote", "zapper": "remote", "clicker": "remote",
    "crate": "box", "bin": "box", "container": "box", "basket": "box",
    "cube": "block", "brick": "block",
    "thing": "object", "item": "object", "something": "object",
    "gray": "grey", "violet": "purple",
})  # fmt: skip
KIND_WORDS: Final = "|".join(sorted({*OBJECT_CLASSES, *SYNONYMS}, key=len, reverse=True))
"""Part of a pattern that finds whatever a kind of thing is called; the longest words first."""
FILLERS: Final = frozenset({"old", "new", "one", "storage"})
# The first row that is large enough wins.
DISTANCES: Final = (("near", 1.0), ("mid", 2.5), ("far", float("inf")))
SIZES: Final = (("tiny", 0.05), ("small", 0.12), ("medium", 0.25), ("large", float("inf")))
FORMS: Final[Mapping[str, Callable[[float, float, float], bool]]] = MappingProxyType(
    {
        "tall": lambda length_m, _, height_m: height_m > 1.5 * length_m,
        "flat": lambda _, width_m, height_m: height_m < 0.4 * width_m,
        "long": lambda length_m, width_m, _: length_m > 2.0 * width_m,
    }
)
# Of several of a kind, "the small one" is smaller than the middle one by this ratio.
COMPARED: Final[Mapping[str, int]] = MappingProxyType(
    {"small": -1, "little": -1, "big": 1, "large": 1}
)
DIFFERENCE_RATIO: Final = 1.15


def distance_word(distance_m: float) -> str:
    """Return near, mid or far."""
    return next(word for word, most_m in DISTANCES if distance_m <= most_m)


def size_word(thing: Thing) -> str:
    """Return tiny, small, medium or large, by the longest side."""
    return next(word for word, most_m in SIZES if max(thing.size_m) <= most_m)


def form_words(thing: Thing) -> tuple[str, ...]:
    """Return which of tall, flat and long a thing is."""
    length_m, width_m = max(thing.size_m[:2]), min(thing.size_m[:2])
    return tuple(word for word, is_so in FORMS.items() if is_so(length_m, width_m, thing.size_m[2]))


def compared(word: str, things: Sequence[Thing]) -> list[Thing]:
    """Return those of several things that a word such as "small" distinguishes from the others.

    Of things that do not differ, and of a single one, all are returned.
    """
    sign = COMPARED[word]
    if len(things) < 2:
        return list(things)
    volumes = [(one.size_m[0] * one.size_m[1] * one.size_m[2]) ** (1.0 / 3.0) for one in things]
    least, most = min(volumes), max(volumes)
    if most < DIFFERENCE_RATIO * least:
        return list(things)
    middle = 0.5 * (least + most)
    pairs = zip(things, volumes, strict=True)
    return [one for one, volume in pairs if sign * (volume - middle) >= 0.0]
