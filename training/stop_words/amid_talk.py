"""Put a word amid others at random, so that no words around it tell whether it was said.

An ear that hears stop words only where a few phrases have them learns the phrases: after any other
words it misses them, and what sounds alike it then takes for one after these.
"""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from training.stop_words.picking import pick

MOST_BEFORE: Final = 4
MOST_AFTER: Final = 3
COMMA_SHARE: Final = 0.25
_WORD: Final = re.compile(r"[A-Za-z][A-Za-z']*")


def amid_talk(
    word: str, random: np.random.Generator, talk: Sequence[str], *, before: bool, after: bool
) -> str:
    """Return the word behind some words of a sentence of the talk, or before some, or both."""
    parts = [word]
    if before:
        parts.insert(0, _piece(talk, MOST_BEFORE, random))
    if after:
        parts.append(_piece(talk, MOST_AFTER, random))
    return (", " if random.random() < COMMA_SHARE else " ").join(parts)


def _piece(talk: Sequence[str], most: int, random: np.random.Generator) -> str:
    """Return some neighbouring words of a sentence."""
    words = _WORD.findall(pick(talk, random))
    count = min(len(words), int(random.integers(1, most + 1)))
    start = int(random.integers(len(words) - count + 1))
    return " ".join(words[start : start + count])
