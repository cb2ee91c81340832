"""Recognise names that were misspelt or misheard: by edit distance, by sound, by homophones.

Nothing here decides alone: a spelling that is one letter off a long word is taken, what only sounds
alike is offered as a question.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from types import MappingProxyType
from typing import Final

# Words that sound the same to any recogniser of speech; what is right of the colon can be meant.
HOMOPHONES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "read": "red", "reed": "red", "blew": "blue", "grayed": "grey", "wight": "white",
        "quays": "keys", "kees": "keys", "bawl": "ball", "bole": "bowl", "boll": "bowl",
        "bocks": "box", "fone": "phone", "kup": "cup", "cupp": "cup", "bottel": "bottle",
        "wright": "right", "write": "right", "hear": "here", "their": "there",
    }
)  # fmt: skip
# A word this long may be one letter wrong, or two; shorter ones are too near to other words.
SPELLING: Final = ((5, 1), (8, 2))
# What only sounds alike must still look alike.
MOST_UNLIKE: Final = 2


class Likeness(StrEnum):
    """Say in what way a word is like a known one, the surest first."""

    SAME = "same"
    SOUNDS_SAME = "homophone"
    MISSPELT = "one letter off"
    SOUNDS_ALIKE = "sounds alike"


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """Hold the known words that a word may mean; several are equally like it."""

    word: str
    known: tuple[str, ...]
    likeness: Likeness

    @property
    def is_sure(self) -> bool:
        """Tell whether it may be taken without asking."""
        return len(self.known) == 1 and self.likeness is not Likeness.SOUNDS_ALIKE


def closest(word: str, known: Iterable[str]) -> Match | None:
    """Return what a word most likely means, or None where nothing known is like it."""
    return _closest(word, tuple(dict.fromkeys(known)))


@lru_cache(maxsize=1024)
def _closest(word: str, words: tuple[str, ...]) -> Match | None:
    if word in words:
        return Match(word=word, known=(word,), likeness=Likeness.SAME)
    if HOMOPHONES.get(word) in words:
        return Match(word=word, known=(HOMOPHONES[word],), likeness=Likeness.SOUNDS_SAME)
    tests = (
        (Likeness.MISSPELT, tuple(one for one in words if _is_misspelt(word, one))),
        (Likeness.SOUNDS_ALIKE, tuple(one for one in words if _sounds_alike(word, one))),
    )
    return next(
        (Match(word=word, known=found, likeness=how) for how, found in tests if found), None
    )


def edit_distance(one: str, other: str) -> int:
    """Return how many letters to insert, drop, replace, or swap with their neighbour."""
    before: list[int] = []
    row = list(range(len(other) + 1))
    for i, letter in enumerate(one, start=1):
        before, last, row = row, before, [i]
        for j, facing in enumerate(other, start=1):
            cost = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != facing))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == facing:
                cost = min(cost, last[j - 2] + 1)
            row.append(cost)
    return row[-1]


# Applied in this order; capital letters are sounds that no single letter stands for.
_SOUNDS: Final[tuple[tuple[re.Pattern[str], str], ...]] = tuple(
    (re.compile(pattern), sound)
    for pattern, sound in (
        (r"[^a-z]", ""),
        (r"^(?:kn|gn|pn)", "n"), (r"^wr", "r"), (r"^wh", "w"), (r"mb$", "m"),
        (r"tch|ch", "X"), (r"sh|sch|(?<=.)ti(?=on)", "S"), (r"th", "0"), (r"ph", "f"),
        (r"gh(?=t|$)", ""), (r"dge", "j"), (r"c(?=[eiy])", "s"), (r"ck|c|q", "k"), (r"x", "ks"),
        (r"z", "s"), (r"(?<=.)[aeiouyhw]", ""), (r"^[aeiouy]", "A"), (r"(.)\1+", r"\1"),
    )
)  # fmt: skip


@lru_cache(maxsize=1024)
def phonetic_key(word: str) -> str:
    """Return the consonants of a word by their sound: "phone" and "fan" are both "fn"."""
    for pattern, sound in _SOUNDS:
        word = pattern.sub(sound, word)
    return word


def _is_misspelt(word: str, known: str) -> bool:
    allowed = max((most for least, most in SPELLING if min(len(word), len(known)) >= least),
                  default=0)  # fmt: skip
    return abs(len(word) - len(known)) <= allowed and 0 < edit_distance(word, known) <= allowed


def _sounds_alike(word: str, known: str) -> bool:
    return phonetic_key(word) == phonetic_key(known) and edit_distance(word, known) <= MOST_UNLIKE
