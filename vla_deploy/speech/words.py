"""Know the few words that hearing itself acts on: those that stop, those that end no command."""

import re
from collections.abc import Set
from typing import Final

STOPS: Final = frozenset({"stop", "halt", "freeze"})
_POLITE: Final = frozenset(
    {
        "robot", "butler", "please", "now", "hey", "moving", "it", "that", "okay", "ok", "no", "oh",
        "emergency", "right", "there", "at", "once", "immediately", "everything", "driving",
        "just", "wait", "whoa", "i", "said", "can", "could", "you", "this", "all", "away",
        "doing", "what", "are", "you're",
    }
)  # fmt: skip
_COURTESIES: Final = frozenset(
    {"please", "thanks", "thank", "you", "um", "uh", "hm", "hmm", "ah", "oh", "er"}
)
_UNFINISHED: Final = frozenset(
    {
        "a", "an", "and", "at", "behind", "beside", "by", "from", "in", "into", "is", "my",
        "near", "of", "on", "onto", "or", "put", "take", "the", "then", "this", "to",
        "under", "with", "your", "bring",
    }
)  # fmt: skip
_WORD: Final = re.compile(r"[^\W_]+(?:['’][^\W_]+)*")


def words_of(text: str) -> tuple[str, ...]:
    """Return the words of a text in small letters, without punctuation."""
    return tuple(_WORD.findall(text.lower()))


def is_stop(text: str, names: Set[str] = frozenset()) -> bool:
    """Return whether a text is nothing but a call to stop, however often and politely.

    `names` are further ones that the robot answers to.
    """
    return holds_stop(text) and STOPS | _POLITE | names >= set(words_of(text))


def holds_stop(text: str) -> bool:
    """Return whether a call to stop is among the words."""
    return not STOPS.isdisjoint(words_of(text))


def is_courtesy(text: str) -> bool:
    """Return whether a text has nothing in it to do or to answer."""
    return all(word in _COURTESIES for word in words_of(text))


def is_unfinished(text: str) -> bool:
    """Return whether a speaker who pauses after these words has surely more to say."""
    words = words_of(text)
    return not words or words[-1] in _UNFINISHED
