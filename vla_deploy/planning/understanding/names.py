"""Recognise names that were misspelt or misheard: by homophones and edit distance.

A spelling that is one letter off a long word is taken; what is only like a short one is offered as
a question.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """Hold the known words that a word may mean; several are equally like it.

    What is `near` sounds the same, or is misspelt.
    """

    word: str
    known: tuple[str, ...]
    near: bool

    @property
    def is_sure(self) -> bool:
        """Tell whether it may be taken without asking."""
        return self.near and len(self.known) == 1


def closest(word: str, known: Iterable[str]) -> Match | None:
    """Return what a word most likely means, or None where nothing known is like it."""
    return _closest(word, tuple(dict.fromkeys(known)))


@lru_cache(maxsize=1024)
def _closest(word: str, words: tuple[str, ...]) -> Match | None:
    same = word if word in words else HOMOPHONES.get(word)
    if same in words:
        return Match(word=word, known=(str(same),), near=True)
    misspelt = tuple(one for one in words if _is_misspelt(word, one))
    if misspelt:
        return Match(word=word, known=misspelt, near=True)
    alike = tuple(one for one in words if _is_alike(word, one))
    return Match(word=word, known=alike, near=False) if alike else None


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


def _is_misspelt(word: str, known: str) -> bool:
    allowed = max((most for least, most in SPELLING if min(len(word), len(known)) >= least),
                  default=0)  # fmt: skip
    return abs(len(word) - len(known)) <= allowed and 0 < edit_distance(word, known) <= allowed


def _is_alike(word: str, known: str) -> bool:
    """Tell whether words differ by one letter between the first and the last: "cap" and "cup"."""
    ends_alike = word[:1] == known[:1] and word[-1:] == known[-1:]
    return len(word) > 2 and ends_alike and edit_distance(word, known) == 1
