"""List how people refer to things beyond kind and colour: tables of pronouns, sides, orders.

The vocabulary of the world says what things are called; here is what points at them.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

PRONOUNS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "it": "it", "that": "it", "this": "it", "one": "it", "that one": "it", "this one": "it",
        "the same": "it", "same one": "it", "the same one": "it", "that thing": "it",
        "this thing": "it", "the thing": "it", "the one": "it",
        "them": "them", "those": "them", "these": "them", "all of them": "them", "them all": "them",
        "both": "them", "both of them": "them", "them both": "them", "the both of them": "them",
        "there": "there", "over there": "there", "that place": "there", "back there": "there",
        "here": "here", "over here": "here", "back here": "here", "this place": "here",
    }
)  # fmt: skip
IT: Final = "it"
THEM: Final = "them"
THERE: Final = "there"
HERE: Final = "here"
HELD: Final = "held"
SIDES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "left": "left", "leftmost": "left", "right": "right", "rightmost": "right",
        "middle": "middle", "centre": "middle", "center": "middle",
    }
)  # fmt: skip
EXTREMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "biggest": "big", "bigger": "big", "largest": "big", "larger": "big",
        "smallest": "small", "smaller": "small",
    }
)  # fmt: skip
ORDER_WORDS: Final[Mapping[str, str]] = MappingProxyType(
    {"nearer": "nearest", "closer": "nearest", "further": "farthest", "furthest": "farthest",
     "farther": "farthest"}
)  # fmt: skip
# Places in the row of the things that a question names; -1 is the end.
ORDINALS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "first": 1, "1st": 1, "second": 2, "2nd": 2, "third": 3, "3rd": 3, "fourth": 4, "4th": 4,
        "last": -1,
    }
)  # fmt: skip
# What a thing is for or made of, before its kind, tells no two of the known kinds apart.
MODIFIERS: Final = frozenset(
    {
        "coffee", "tea", "water", "soda", "coke", "beer", "juice", "wine", "milk", "soup", "salad",
        "cereal", "fruit", "tennis", "toy", "car", "house", "door", "tv", "cell", "mobile", "smart",
        "storage", "plastic", "cardboard", "paper", "wooden", "metal", "glass", "nice",
    }
)  # fmt: skip
