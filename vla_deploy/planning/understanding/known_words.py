"""List the words that descriptions are made of, for telling slips of them from other words."""

from functools import cache
from typing import Final

from vla_deploy.world.query import ORDERS, PHRASES
from vla_deploy.world.vocabulary import ARTICLES, COLOURS, FILLERS, OBJECT_CLASSES, SYNONYMS
from vla_deploy.world.words import COMPARED, FORMS

_SHORT: Final = 4
# Plurals that mean another thing than several of one.
_OF_THEIR_OWN: Final = frozenset({"glasses"})


def single(word: str) -> str:
    """Return the singular of a plural of a known kind, else the word."""
    if word in known_words() | _OF_THEIR_OWN or not word.endswith("s"):
        return word
    return next((one for one in (word[:-2], word[:-1]) if is_kind(one)), word)


def is_kind(word: str) -> bool:
    """Tell whether a word names a kind of thing."""
    return SYNONYMS.get(word, word) in OBJECT_CLASSES


@cache
def likely_words() -> tuple[str, ...]:
    """Return the words that a name may be a slip of; short words are like too many others."""
    return (*OBJECT_CLASSES, *COLOURS, *(word for word in SYNONYMS if len(word) > _SHORT))


@cache
def relation_words() -> frozenset[str]:
    """Return the words of what relates one thing to another."""
    return frozenset(word for phrase in PHRASES for word in phrase.split())


@cache
def known_words() -> frozenset[str]:
    """Return every word that a query is made of."""
    groups = (OBJECT_CLASSES, COLOURS, SYNONYMS, ARTICLES, FILLERS, COMPARED, FORMS, ORDERS)
    return frozenset(word for group in groups for word in group) | relation_words()
