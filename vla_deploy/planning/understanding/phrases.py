"""List how people refer to things beyond kind and colour: tables of pronouns, sides, extremes.

The vocabulary of the world says what things are called; here is what points at them.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

PRONOUNS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "it": "it", "that": "it", "this": "it", "one": "it", "that one": "it", "this one": "it",
        "the same": "it", "same one": "it", "the same one": "it", "that thing": "it",
        "this thing": "it", "the thing": "it", "the one": "it", "itself": "it",
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
        "left": "left", "leftmost": "left", "left-most": "left", "lefthand": "left",
        "right": "right", "rightmost": "right", "righthand": "right",
        "middle": "middle", "central": "middle", "centre": "middle", "center": "middle",
    }
)  # fmt: skip
# A superlative picks one where the adjective may leave several.
EXTREMES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "biggest": "big", "largest": "big", "bigger": "big", "larger": "big",
        "smallest": "small", "littlest": "small", "tiniest": "small", "smaller": "small",
        "littler": "small", "tinier": "small",
        "tallest": "tall", "taller": "tall",
        "shortest": "short", "shorter": "short",
        "longest": "long", "longer": "long",
        "highest": "high", "higher": "high", "topmost": "high", "uppermost": "high",
        "lowest": "low", "lower": "low", "bottommost": "low",
        "widest": "wide", "wider": "wide", "broadest": "wide", "narrowest": "narrow",
        "narrower": "narrow",
        "thickest": "thick", "thicker": "thick", "fattest": "thick", "fatter": "thick",
        "thinnest": "thin", "thinner": "thin", "slimmest": "thin", "slimmer": "thin",
        "flattest": "thin", "flatter": "thin",
    }
)  # fmt: skip
ORDER_WORDS: Final[Mapping[str, str]] = MappingProxyType(
    {"nearer": "nearest", "closer": "nearest", "further": "farthest", "furthest": "farthest",
     "farther": "farthest", "tiny": "small", "mini": "small", "wee": "small", "huge": "big",
     "giant": "big"}
)  # fmt: skip
# Places in a row or in a list; -1 is the end.
ORDINALS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "first": 1, "1st": 1, "second": 2, "2nd": 2, "third": 3, "3rd": 3, "fourth": 4, "4th": 4,
        "fifth": 5, "5th": 5, "sixth": 6, "6th": 6, "last": -1,
    }
)  # fmt: skip
NUMBERS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6,
        "1": 1, "2": 2, "3": 3, "4": 4, "5": 5, "6": 6,
    }
)  # fmt: skip
# What a thing is for or made of, before its kind, tells no two of the known kinds apart.
MODIFIERS: Final = frozenset(
    {
        "coffee", "tea", "water", "soda", "coke", "cola", "pop", "beer", "juice", "wine", "milk",
        "soup", "salad", "cereal", "breakfast", "fruit", "tennis", "bouncy", "toy", "car", "house",
        "door", "office", "tv", "telly", "television", "cell", "mobile", "smart", "cook", "reading",
        "story", "school", "library", "storage", "drinking", "rubber", "plastic", "cardboard",
        "paper", "wooden", "metal", "ceramic", "glass", "favourite", "favorite", "nice", "lovely",
        "good", "shiny", "same",
    }
)  # fmt: skip
# Words between a thing and where it stands, which say nothing.
SILENT: Final = frozenset(
    {"is", "are", "which", "standing", "lying", "sitting", "resting", "please", "lies", "stands"}
)
COUNTS: Final[Mapping[str, int]] = MappingProxyType(
    {"two": 2, "three": 3, "four": 4, "2": 2, "3": 3, "4": 4, "both": 2, "couple": 2, "pair": 2}
)
