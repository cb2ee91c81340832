"""Find in a command what only points at the one before it, where the rest only tells.

"Hmm, your back wheels are still on it. Do that again." is "do that again".
"""

import re
from typing import Final

from vla_deploy.planning.asking import Request
from vla_deploy.planning.rules.fits import known_fit
from vla_deploy.planning.rules.recalling import points_back

_PIECE: Final = re.compile(r"\s*[,;.!?]+\s*")
_TELLS: Final = re.compile(
    r"(?:and |but |because |since )?"
    r"(?:it|that|this|these|they|he|she|we|i|you|there|your|my|our|the)"
    r"(?:'\w+)? .+|(?:still |not |very |nearly |almost )*(?:quite|nearly|almost|there|enough|good|"
    r"nice|lovely|perfect|encore|yet|closer|better)(?: \w+){0,2}|(?:a bit |way |much )?too \w+|"
    r"(?:hm+|ah|oh|no|nah|ta|thanks)"
)
_DENIES: Final = re.compile(r"\b(?:not|never|no|nothing|stay|stop|enough)\b|n't\b")


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
