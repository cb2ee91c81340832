"""Know the few words that hearing itself heeds: those that stop, and those that end no command."""

import re
from typing import Final

STOPS: Final = frozenset({"stop", "halt", "freeze"})
_FORMS: Final = re.compile(
    r"\b(?:stop(?:ped|ping|per|s)|halt(?:ed|ing|er|s)|freez(?:ing|er|es)|froze|frozen)\b"
)
_POLITE: Final = frozenset(
    {
        "robot", "butler", "please", "now", "hey", "moving", "it", "that", "okay", "ok", "no", "oh",
        "emergency", "right", "there", "at", "once", "immediately", "everything", "driving",
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


def is_stop(text: str) -> bool:
    """Tell whether a text is nothing but a call to stop, however often and politely."""
    words = words_of(text)
    return any(word in STOPS for word in words) and all(
        word in STOPS or word in _POLITE for word in words
    )


def holds_stop(text: str, *, is_all: bool = True) -> bool:
    """Tell whether a call to stop is among the words; of words cut off the last may be another."""
    words = words_of(text)
    return any(word in STOPS for word in (words if is_all else words[:-1]))


def holds_form_of_stop(text: str) -> bool:
    """Tell whether a word is among the others that sounds like a call to stop and is none."""
    return _FORMS.search(text.lower()) is not None


def is_courtesy(text: str) -> bool:
    """Tell whether a text has nothing in it to do or to answer."""
    return all(word in _COURTESIES for word in words_of(text))


def is_unfinished(text: str) -> bool:
    """Tell whether a speaker who pauses after these words has surely more to say."""
    words = words_of(text)
    return not words or words[-1] in _UNFINISHED
