"""Take an answer that tells a thing by another one, which no candidate is called by."""

import re
from typing import Final

from vla_deploy.planning.understanding.answers import WORD
from vla_deploy.planning.understanding.conversation import Question

_WHERE: Final = re.compile(
    r"(?:(?:no|yes|well|um|uh|oh|ah|sorry|pet|love|dear|mate|i (?:mean|meant|want|said)|it(?:'s| "
    r"is)|take|make it|use) )*"
    r"(?:the|that) (?:one|(?P<noun>[a-z]+)) (?:(?:that|which)(?:'s| is) )?(?P<where>(?:right )?"
    r"(?:next to|close to|beside|behind|in front of|near|nearer to|closer to|nearest(?: to)?|"
    r"closest to|by|between|"
    r"under|beneath|on top of|left of|right of|to the (?:left|right) of|opposite|inside|in|on)"
    r" .+?)(?:,? (?:please|then|thanks|thank you|i think|i guess))*"
)


def described(question: Question, text: str) -> str | None:
    """Return the waiting command in full where an answer says by which other thing one stands.

    "the one next to the book", to "pick up the cup" -> "pick up the cup next to the book".
    """
    found = _WHERE.fullmatch(" ".join(WORD.findall(text.lower())))
    expression = question.expression
    command = question.command_text
    if found is None or not question.candidates or not expression:
        return None
    if found["noun"] and found["noun"] not in expression.split():
        return None
    named = list(re.finditer(rf"\b{re.escape(expression)}\b", command, re.IGNORECASE))
    if len(named) != 1:
        return None
    end = named[0].end()
    return f"{command[:end]} {found['where']}{command[end:]}"
