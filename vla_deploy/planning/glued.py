"""Part words that a recogniser has run into one: "theentrance", "keysout", "pointout".

It knows pieces of words, and at times forgets the space before one.
"""

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from vla_deploy.world.vocabulary import COLOURS, KIND_WORDS

_ARTICLES: Final = "the|my|your|a"
_BEHIND: Final = "out|off|up|down|back|over|away|around|in|on"
_BEFORE: Final = (
    "back|point|take|pick|get|put|come|go|find|look|fish|turn|set|drop|bring|carry|hand|move|drive"
)


def parted(text: str, names: Iterable[str]) -> str:
    """Return a text with such words apart; `names` are those of places."""
    for pattern in _patterns(tuple(sorted({name.split()[0] for name in names}))):
        text = pattern.sub(r"\1 \2", text)
    return text


@lru_cache(maxsize=8)
def _patterns(names: tuple[str, ...]) -> tuple[re.Pattern[str], ...]:
    named = "|".join([KIND_WORDS, *COLOURS, *map(re.escape, names)])
    return (
        re.compile(rf"\b({_ARTICLES})((?:{named})s?)\b"),
        re.compile(rf"\b((?:{KIND_WORDS})s?|{_BEFORE})({_BEHIND})\b"),
    )
