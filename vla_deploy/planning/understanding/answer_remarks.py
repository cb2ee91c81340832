"""Tell what of an answer picks something from what is only told beside it."""

import re
from collections.abc import Callable, Sequence
from typing import Final

from vla_deploy.planning.understanding.conversation import Candidate

# What is told beside an answer, and picks nothing.
_REMARK: Final = re.compile(
    r"(?:and |but |because |since |where )?(?:it|they|that|those|he|she|there|i|we|you|my \w+)"
    r"(?:'\w+)?\b.*"
)
# The same of another candidate: "the little one won't go round".
_TELLS: Final = re.compile(
    r"(?:and |but |because |since )?(?:the|that|this|t'?other) ?.+?(?:'s|n't| is| are| was| has| "
    r"will| can| goes| stays| belongs)\b.+"
)
_MEANT: Final = re.compile(
    r"(?:'s| is| was) (?:what|the one|which one)(?: that)? i(?:'m| am| was)? (?:mean|meant|want|"
    r"wanted|need|needed|after|had in mind|thinking of|talking about)\b.*"
)


def picked_beside(
    pieces: Sequence[str], picked: Callable[[str], Candidate | None]
) -> Candidate | None:
    """Return the one that some pieces of an answer pick, None where they differ or ask for more.

    A piece that tells of a candidate picks it only where no other piece picks any.
    """
    told = [_MEANT.sub("", piece) for piece in pieces if piece]
    judged = {piece: picked(piece) for piece in told}
    picks = [piece for piece, chosen in judged.items() if chosen is not None]
    picks = [piece for piece in picks if not _TELLS.fullmatch(piece)] or picks
    chosen = {one.name: one for piece in picks if (one := judged[piece]) is not None}
    beside = [piece for piece in told if piece not in picks]
    is_clear = all(_REMARK.fullmatch(one) or _TELLS.fullmatch(one) for one in beside)
    return next(iter(chosen.values())) if len(chosen) == 1 and is_clear else None
