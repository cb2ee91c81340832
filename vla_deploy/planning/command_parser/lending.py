"""Give "the smaller one" its kind where several were named before: of "two bottles", the smaller.

The model copies both, wherever they stand: "(of the) two bottles (i need only the) smaller one".
"""

import re
from typing import Final

from vla_deploy.world.vocabulary import KIND_WORDS

_ARTICLE: Final = r"(?:the|my|our|your|that|this)"
_WHERE: Final = (
    r"(?: (?:on|in|at|by|under|near|next to|beside|behind|from) "
    rf"(?:{_ARTICLE} )?(?!{_ARTICLE}\b)[\w']+(?: (?!{_ARTICLE}\b|one\b)[\w']+)?)"
)
_SEVERAL_AND_ONE: Final = re.compile(
    r"(?:(?:all|both|the|those|these|my|our|of|two|three|four|a|couple|pair|few) )*"
    rf"(?P<kind>{KIND_WORDS})(?:e?s)?(?P<several>{_WHERE})?"
    rf"(?: of)? (?:(?:the )?(?P<which>(?!other |same |the )[\w-]+ )one|the one(?P<one>{_WHERE}))"
)


def kind_lent(thing: str) -> str:
    """Return "smaller bottle" for "the two bottles the smaller one", any other thing as it is.

    Where the one is goes before where they all are.
    """
    found = _SEVERAL_AND_ONE.fullmatch(thing)
    if found is None:
        return thing
    return f"the {found['which'] or ''}{found['kind']}{found['one'] or found['several'] or ''}"
