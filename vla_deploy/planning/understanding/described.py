"""Take an answer that tells a thing by another one, which no candidate is called by."""

import re
from typing import Final

from vla_deploy.planning.understanding.answer_words import WORD
from vla_deploy.planning.understanding.conversation import Question
from vla_deploy.world.vocabulary import KIND_WORDS

_WHERE: Final = re.compile(
    r"(?:(?:no|yes|well|um|uh|oh|ah|sorry|pet|love|dear|mate|good question|it(?:'s| is)|"
    r"i (?:mean|meant|want|said)|take|make it|use) )*"
    r"(?:the|that) (?P<which>[a-z]+ )??(?:one|(?P<noun>[a-z]+)) (?:(?:that|which)(?:'s| is) )?"
    r"(?P<where>(?:(?:right|just) )?(?:(?:up|over|down) )?"
    r"(?:next to|close to|beside|behind|in front of|near|nearer to|closer to|nearest(?: to)?|"
    r"closest to|by|between|"
    r"under|beneath|on top of|left of|right of|to the (?:left|right) of|opposite|inside|in|on)"
    r" .+?)(?: (?:please|then|thanks|thank you|i think|i guess)| so (?:that )?(?:i|we) can .*)*"
)

_KIND: Final = re.compile(rf"\b(?:{KIND_WORDS})\b")


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
    noun = _KIND.search(expression)
    # "The ball from the table" may have been said as "lift the ball up off the table".
    spelt = (expression, *(() if noun is None else (f"the {noun[0]}",)))
    found_in = [list(re.finditer(rf"\b{re.escape(it)}\b", command, re.IGNORECASE)) for it in spelt]
    named = next((one for one in found_in if one), [])
    if len(named) != 1:
        return None
    start, end = named[0].span()
    which = found["which"] or ""
    return f"{command[:start]}{which}{command[start:end]} {found['where']}{command[end:]}"
