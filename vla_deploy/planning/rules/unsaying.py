"""Know what is no mere remark beside a command, since it unsays it, forbids it, or only quotes it.

"Take the cup to the kitchen, I changed my mind"   "..., that's forbidden"   "..., he says"
"""

import re
from typing import Final

from vla_deploy.planning.references import words_of

_WORDS: Final = (
    # taken back, or done by somebody else
    r"changed (?:my|our) mind|jok(?:e|ing)|kidding|take (?:it|that|this) back|didn't mean|"
    r"(?:found|got|have|'ve got) (?:it|them|one) already|already (?:got|have|found)|found it|"
    r"i'll do|we'll do|i will do|can wait|do(?:es)?n't have to|not (?:done|finished|yet)|"
    r"(?:we're|i'm) still \w+ing|"
    r"though|prefer|instead|rather|cancel|leave it(?! (?:on|in|there|here))|not talking to you|"
    r"n't talking to you|by you",
    # forbidden, or foolish
    r"forbidden|not allowed|isn't allowed|dangerous|careful|avoid|never|mustn't|must not|(?:be|"
    r"that's|it's) wrong|"
    r"can't let|won't let|wouldn't|shouldn't|should not",
    # under a condition
    r"if|unless|whenever",
    # somebody else's words
    r"said|says|told|tells|asked|asks|shout(?:s|ed)|wrote|quote|words|she goes|he goes|song|"
    r"thinks|thought|claims|claimed|believes|insists|reckons|i (?:read|saw|heard)(?! (?:a|the)\b)|"
    r"where (?:it is|they are)$|"
    r"always going",
)
_UNSAYS: Final = re.compile(
    rf"\b(?:{'|'.join(_WORDS)})\b|"
    r"^(?:and |but )?(?:until|till|provided|in case|assuming|suppos(?:e|ing)|imagine|pretend)\b"
)
_STOPS: Final = frozenset({"stop", "halt", "freeze"})


def unsays(part: str) -> bool:
    """Tell whether a part of a command, in lower case, may not be left out as a remark."""
    return _UNSAYS.search(part) is not None or not _STOPS.isdisjoint(words_of(part))
