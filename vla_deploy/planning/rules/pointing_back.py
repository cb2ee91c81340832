"""Find in a command what only points at the one before it, where the rest only tells.

"Hmm, your back wheels are still on it. Do that again." is "do that again".
"""

import re
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.rules.fits import known_fit
from vla_deploy.planning.rules.recalling import points_back
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.world.vocabulary import KIND_WORDS

_PIECE: Final = re.compile(r"\s*[,;.!?]+\s*")
_TELLS: Final = re.compile(
    r"(?:and |but |because |since )?"
    r"(?:it|that|this|these|they|he|she|we|i|you|there|your|my|our|the)"
    r"(?:'\w+)? .+|(?:still |not |very |nearly |almost )*(?:quite|nearly|almost|there|enough|good|"
    r"nice|lovely|perfect|encore|yet|closer|better)(?: \w+){0,2}|(?:a bit |way |much )?too \w+|"
    r"(?:hm+|ah|oh|no|nah|ta|thanks)"
)
_DENIES: Final = re.compile(r"\b(?:not|never|no|nothing|stay|stop|enough)\b|n't\b")

# "The cup that is on it", "the one next to it"; "put the cup on it" says where to.
_BY_IT: Final = re.compile(
    rf"\b(?P<thing>(?:the|that|my) (?:[a-z]+ )?(?:{KIND_WORDS}|one|thing))"
    r"(?: that is| that's| which is| standing| lying| sitting)? "
    r"(?P<where>on|in|next to|beside|near|by|left of|right of) it(?=$|[,.!?])"
)
_PUTS: Final = re.compile(
    r"\b(?:put|place|set|drop|pop|stick|leave|lay|move|carry|goes|go|belongs?)\b"
)
_RESTING: Final = ("on", "in")


def by_another(text: str, request: Request) -> str:
    """Return "the cup on the kitchen table" for "the cup on it", after "go to the kitchen table".

    What "it" is next to is the thing that was spoken of last.
    """
    found = _BY_IT.search(text)
    before = "" if found is None else text[: found.start()]
    if found is None or _PUTS.search(before):
        return text
    roles = (Role.PLACE, Role.DESTINATION) if found["where"] in _RESTING else (Role.OBJECT,)
    spoken = next((one for one in request.conversation.mentions() if one.role in roles), None)
    is_told_here = _PIECE.search(before) is not None or " and " in before
    told = "" if spoken is None or is_told_here else f" {found['where']} the {_words(spoken)}"
    return f"{before}{found['thing']}{told}{text[found.end() :]}"


def _words(spoken: Mention) -> str:
    return spoken.means.replace("_", " ") if spoken.role is Role.PLACE else spoken.means


def pointing_alone(text: str, request: Request) -> str:
    """Return the only part that points back, or the whole where another may be a command."""
    pieces = [piece for piece in _PIECE.split(text) if piece]
    pointing = [piece for piece in pieces if points_back(piece)]
    others = [piece for piece in pieces if piece not in pointing]
    if len(pointing) != 1 or not all(_TELLS.fullmatch(one) for one in others):
        return text
    if any(known_fit(one, request) is not None for one in others):
        return text
    return text if _DENIES.search(pointing[0]) else pointing[0]
