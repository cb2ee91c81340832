"""Cut a command into plain clauses: lower case, no courtesies, one action each."""

import re
from typing import Final

MOST_CLAUSES: Final = 6
MOST_LETTERS: Final = 300
_VERBS: Final = (
    "go|drive|come|move|turn|look|pick|grab|take|get|put|place|set|drop|bring|fetch|give|hand|carry|"
    "find|search|open|close|wait|say|tuck|tidy|tell|stop|return|lay|hold|locate|lift|switch"
)
_BEFORE: Final = re.compile(
    r"^(?:(?:please|robot|butler|hey|hello|hi|ok|okay|well|so|now|just|and|then|next|also|"
    r"(?:can|could|would|will) you(?: please| kindly)?|i(?:'d| would) like you to|i want you to|"
    r"i need you to|would you mind|go ahead and|be so kind(?: as to)?(?: and)?|first(?= \w))"
    r"[, ]+)+"
)
_BEHIND: Final = re.compile(
    r"(?:[, ]+(?:please|thanks|thank you|now|right now|for me|if you can|if you could|"
    r"will you|would you|robot|butler|okay|then))+$"
)
_JOINT: Final = re.compile(
    r"[,;.!?]?\s+(?:and then|then|after that|and)\s+(?:please )?"
    rf"(?=(?:{_VERBS})\b)|[,;.!?]\s*(?:and |then |and then )?(?=(?:please |now )?(?:{_VERBS})\b)"
)
_AND: Final = re.compile(r"\s*(?:,\s*and|,|\band\b)\s*")


def clauses(text: str) -> tuple[str, ...]:
    """Return the clauses of a command in their order; none of a text that is too long."""
    if len(text) > MOST_LETTERS:
        return ()
    parts = tuple(filter(None, map(courtesy_off, _JOINT.split(plain(text)))))
    return parts if len(parts) <= MOST_CLAUSES else ()


def courtesy_off(text: str) -> str:
    """Return a clause in lower case without what only asks nicely."""
    return plain(_BEHIND.sub("", _BEFORE.sub("", plain(text))))


def plain(text: str) -> str:
    """Return a text in lower case, with one space between words and no marks around."""
    return " ".join(text.lower().replace("’", "'").split()).strip(" .!?,")


def parts_of(text: str) -> list[str]:
    """Return the things of "the cup, the ball and the book"."""
    return [part for part in _AND.split(text) if part]
