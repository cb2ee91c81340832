"""Read what is said when somebody thinks again: "never mind, put it back", "the same place".

Only what follows is asked for. It leans on what was done last, as "again" does (`recalling`).
"""

import re
from typing import Final

_OPENING: Final = (
    r"(?:(?:oh|ah|aw|um|shoot|well|no|nah|actually|wait|sorry|hm+|and|so|but|you know what|"
    r"hang on|hold on|thanks|thank you|ta|right|okay|ok|great|lovely)[,. ]+)*"
)
_DOING: Final = (
    r"(?:put|place|set|take|bring|return|leave|give|get|grab|fetch|pick|go|come|drive|move|find)"
)
_THOUGHT_AGAIN: Final = re.compile(
    rf"{_OPENING}(?:never ?mind(?: (?:that|it))?|forget (?:it|that)|"
    r"(?:i|we|he|she|they|(?:my|the) \w+)(?:'ve|'s| have| has)? changed (?:my|our|his|her|their) "
    r"minds?(?: about (?:it|that|them|this)(?: one)?)?|"
    r"on (?:reflection|second thoughts?)|"
    r"(?:i|we) (?:don't|do not|won't|will not) (?:actually |really )?(?:be )?(?:need|want)(?:ing)? "
    r"(?:it|them|that|this)"
    r"(?: any ?more| after all| now| then)*)"
    rf"(?:\s*[,.;!]+\s*|\s+(?={_DOING}\b)|\s+(?=(?:i|we)(?:'ve| have|'m| am) [^.!?]+[.!?] ))"
    r"(?:(?:and|so|but|just|please|then|you can|you could)[, ]+)*(?P<rest>.+)"
)
_SAME_PLACE: Final = re.compile(
    r"(?P<said>.+?),? (?:(?:in|into|to|at|on) )?(?:the |that )?(?:very |exact )?same "
    r"(?:place|spot|way|box|table|bowl)(?: (?:too|as well|again))?"
)
_COMMANDS: Final = re.compile(rf"(?:(?:and|now|then|also|next) )*{_DOING}\b")
_BETTER: Final = re.compile(
    r",? (?:is|are|would be|might be|'d be) (?:much |far |a bit )?(?:better|nicer|best)$"
)


def thought_again(text: str) -> str:
    """Return what is asked for after all: "put it back" of "never mind, put it back".

    A text of another kind stays as it is.
    """
    found = _THOUGHT_AGAIN.fullmatch(text)
    return _as_before(found["rest"] if found else text)


def _as_before(text: str) -> str:
    """Return "the ball too" for "the ball, same place", "put it there" for "put it in the same"."""
    found = _SAME_PLACE.fullmatch(text)
    if found is None:
        return text
    said = found["said"]
    return f"{said} there" if _COMMANDS.match(said) else f"{said.removesuffix(' too')} too"


def outright(said: str) -> str:
    """Return "in the other box" for "in the other box is better"."""
    return _BETTER.sub("", said)
