"""Find the words by which a command is to wait for a word: "when I say so", "not before I call"."""

import re
from typing import Final

_WORD: Final = (
    r"i (?:say (?:so|go|now|when|the word)|tell you(?: to| so)?|give (?:you )?the (?:word|sign|"
    r"signal|go-ahead)|call(?: you)?|ask you(?: to)?)"
)
_WHEN: Final = (
    r"(?:but )?(?:only )?(?:when(?:ever)?|as soon as|the (?:moment|instant|minute|second)|once|"
    r"after|not (?:before|until|till)) " + _WORD
)
_ORDERS: Final = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        # "When I tell you to go to bed, ..." waits for something else.
        rf"(?:please,? )?{_WHEN}(?:,? then|[,:]|(?<! to)) (?P<rest>(?!to ).+)",
        rf"(?:please )?wait (?:until|till) {_WORD}(?:,? and(?: then)?|,? then|,) (?P<rest>.+)",
        rf"(?P<rest>.+?),? {_WHEN}",
    )
)


def awaiting(text: str) -> str | None:
    """Return what a command wants done at a word, None for a command that waits for none."""
    said = " ".join(text.split()).strip(" .!")
    found = (order.fullmatch(said) for order in _ORDERS)
    return next((one["rest"] for one in found if one), None)


# A mere "yes", "okay" or "right" is said to other people, too, and for an hour.
_BEGINS: Final = re.compile(r"(?:now )?(?:go|go ahead|go on|do it|start|begin)(?: now)?|now")
_AROUND: Final = re.compile(
    r"[,.!]|\b(?:yes|yeah|yep|sure|ok|okay|right|alright|please|then|hey|robot|butler)\b"
)


def is_word(text: str) -> bool:
    """Return whether an utterance is the word that begins a held plan."""
    said = " ".join(_AROUND.sub(" ", text.lower()).split())
    return _BEGINS.fullmatch(said) is not None
