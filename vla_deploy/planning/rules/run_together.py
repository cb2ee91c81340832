"""Put in the commas that nobody hears: speech comes without them, and so do hasty typists.

Only where the next words cannot belong to what stands before: "pick up the red cup, no wait, the
blue one", "my keys are in the kitchen, could you bring them".
"""

import re
from typing import Final

from vla_deploy.planning.rules.verbs import any_verb

_VERBS: Final = any_verb("clean", "search", "see")
_PLACED: Final = "in|on|at|by|near|under|behind|beside|next|inside|somewhere"
_BREAKS: Final = re.compile(
    r"(?<=[a-z']) (?="
    # He has changed his mind.
    r"(?:no wait|wait no|oh no wait|or rather|no sorry|sorry no|sorry i meant?|i meant?|"
    r"actually no|"
    r"no actually|scratch that|(?:no|sorry) make (?:it|that)|"
    rf"no (?:{_VERBS})) "
    # She has said how things are, and asks for something now.
    r"|(?:so )?(?:can|could|would|will) you (?:(?:please|possibly|kindly|just|go and) )*"
    rf"(?:{_VERBS})\b"
    r"|(?:any idea|do you know) where|where (?:is it|are they|is he|is she)$"
    rf"|please (?:{_VERBS}) "
    # They tell where it is.
    rf"|(?:it|they)(?:'s| is| should be| must be| might be|'re| are) (?:[a-z]+ )?(?:{_PLACED})\b"
    r")"
)
# What stands before belongs to what follows.
_JOINED: Final = frozenset(
    {
        "and", "if", "that", "so", "but", "then", "or", "because", "when", "where", "please",
        "robot", "butler", "hey", "okay", "well", "now", "i", "you", "to", "say", "saying", "ask",
        "sorry", "no", "oh", "wait", "unless", "until", "till", "once", "while", "as", "after",
        "before", "whether", "whenever",
    }
)  # fmt: skip
_COUNT_FIRST: Final = re.compile(
    r"^(?:please )?count(?:ing)? from (?:the|your|my) (?P<side>left|right)(?: side)?,? "
    r"(?:and |then |and then )?(?P<rest>.+?\b(?:first|second|third|fourth|fifth|last) \w+)"
)
_QUOTES: Final = re.compile(r"^(?:please )?(?:say|tell|ask|announce|shout|whisper)\b")
_FEWEST_WORDS: Final = 3


def with_commas(text: str) -> str:
    """Return a text in small letters with commas where a new thought surely begins."""
    if _QUOTES.match(text):
        return text
    text = _COUNT_FIRST.sub(r"\g<rest> from the \g<side>", text)
    return _BREAKS.sub(lambda found: _comma(text[: found.start()]), text)


def _comma(before: str) -> str:
    words = before.replace(",", " , ").split()
    goes_on = len(words) < _FEWEST_WORDS or words[-1] in _JOINED
    return " " if goes_on else ", "
