"""Spoil sentences as speech recognisers and hasty typists do, the plan's words along with them."""

from collections.abc import Mapping, Sequence
from random import Random
from typing import Final

from training.planner.sentences.clause import SaidWord
from training.planner.sentences.lists import read_file

_HEARING: Final = read_file("hearing")
MISHEARD: Final[Mapping[str, Sequence[str]]] = _HEARING["misheard"]
_LOST: Final = frozenset(_HEARING["lost"])
_KEPT: Final = frozenset({"them", "this", "that", "these", "those", "there", "here"})
"""A plan may repeat these though nobody said them of its things; each is read letter by letter."""


def misheard(sentence: list[SaidWord], random: Random) -> list[SaidWord]:
    """Return the sentence as it may arrive; words of the plan are never lost."""
    strength = random.choice((0.0, 0.0, 0.0, 0.03, 0.06, 0.12))
    if not strength:
        return sentence
    heard: list[SaidWord] = []
    for word in sentence:
        heard += _one(word, strength, random)
    return heard or sentence


def _one(word: SaidWord, strength: float, random: Random) -> list[SaidWord]:
    chance = random.random()
    if chance < strength and word.owner is None and word.text in _LOST:
        return []
    if chance < strength and word.text in MISHEARD:
        return [SaidWord(random.choice(MISHEARD[word.text]), word.owner)]
    if chance < 0.35 * strength and len(word.text) > 3 and word.text not in _KEPT:
        return [SaidWord(_mistyped(word.text, random), word.owner)]
    if chance > 1.0 - 0.15 * strength and word.owner is None:
        return [word, word]
    return [word]


def _mistyped(text: str, random: Random) -> str:
    at = random.randrange(1, len(text) - 1)
    match random.randrange(3):
        case 0:
            return text[:at] + text[at + 1 :]
        case 1:
            return text[:at] + text[at + 1] + text[at] + text[at + 2 :]
        case _:
            return text[:at] + text[at] + text[at:]
