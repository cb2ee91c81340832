"""List the words for things: kinds, colours, sizes, and what else people call them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

OBJECT_CLASSES: Final = (
    "cup", "ball", "book", "bottle", "phone", "keys", "box", "bowl", "can", "remote", "object",
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
    "thing": "object", "item": "object", "something": "object",
    "gray": "grey", "violet": "purple",
})  # fmt: skip
KIND_WORDS: Final = "|".join(sorted({*OBJECT_CLASSES, *SYNONYMS}, key=len, reverse=True))
"""Part of a pattern that finds whatever a kind of thing is called; the longest words first."""
FILLERS: Final = frozenset({"old", "new", "one", "storage"})
