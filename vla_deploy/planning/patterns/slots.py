"""Say what may stand in the slots of a pattern: names that the robot knows, and nothing else.

So no word that changes what a sentence means can hide in one.
"""

import re
from collections.abc import Mapping
from typing import Final

from vla_deploy.planning.references import match_place
from vla_deploy.planning.understanding.quantities import NUMBER
from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

_ARTICLE: Final = "(?:the|a|an|my|your|that|this|some|our)"
_LOOK: Final = (
    f"(?:{'|'.join(COLOURS)}|gray|violet|small|little|big|large|nearest|closest|smallest|biggest|"
    "smaller|bigger|tall|short|other|left|right)"
)
KIND: Final = f"(?:{KIND_WORDS}|remote control|mobile phone|cell phone)"
_ONE: Final = (
    rf"(?:{_ARTICLE} )?(?:{_LOOK} ){{0,3}}{KIND}|(?:the|that|this) (?:{_LOOK} ){{1,2}}one|"
    "it|that|this|that one|this one|them|those|these"
)
# A word for a thing that the robot has not learnt: grounding asks what it is.
_UNKNOWN: Final = (
    rf"(?:the|a|an|my|that|this) (?:{_LOOK} ){{0,2}}"
    r"(?!one\b|same\b|rest\b|other\b|left\b|right\b|whole\b)[a-z]{3,}"
)
_STANDS: Final = (
    rf" (?:on|in|next to|beside) (?:the|my|your|our) (?:{_LOOK} ){{0,2}}[a-z]+(?: table)?"
)
_SEVERAL: Final = rf"(?:both|all)(?: of)?(?: the| my| our)? (?:{_LOOK} )?{KIND}s?|everything"
_KNOWN: Final = rf"(?:{_ONE}|everything)(?:{_STANDS})?|{_SEVERAL}"
BARE: Final = rf"(?:{_ONE}|{_SEVERAL}|{_UNKNOWN})"
"""A thing that is told by its look alone."""
THING: Final = rf"(?:{_KNOWN}|{_UNKNOWN})"
THINGS: Final = rf"{THING}(?:(?:,| and|, and) {THING})*"
WORDS: Final = r"[a-z][a-z']*(?: [a-z']+){0,4}?"
METRES: Final = (
    rf"{NUMBER}(?: of a| an?)? ?(?:m|met(?:er|re)s?|cm|centimet(?:er|re)s?|feet|foot|steps?)"
)
ANGLE: Final = rf"{NUMBER} ?(?:degrees?|deg|°|rad|radians?)"
SECONDS: Final = rf"{NUMBER}(?: of a| an?)? ?(?:seconds?|secs?|s|minutes?|mins?|moment)"
HAND: Final = (
    r"(?:your |the )?(?:(?P<arm>left|right) )?(?:hand|gripper|claw|fingers|hands|grippers)"
)
_IS_THING: Final = re.compile(_KNOWN)


def is_place(text: str, places: Mapping[str, str]) -> bool:
    """Return whether a text is the whole name of a place."""
    return match_place(text, places) is not None


def is_thing(text: str) -> bool:
    """Return whether a text names a thing in words that the robot knows."""
    return _IS_THING.fullmatch(text) is not None
