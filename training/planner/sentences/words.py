"""Name the words that sentences are filled with: things, colours, places, people, sayings."""

from random import Random
from typing import Final

from training.planner.sentences.lists import read_lists
from vla_deploy.world.vocabulary import COLOURS, OBJECT_CLASSES, SYNONYMS

_WORDS: Final = read_lists("words")
KNOWN_THINGS: Final = (
    *(one for one in OBJECT_CLASSES if one != "object"),
    *(word for word, kind in SYNONYMS.items() if kind in OBJECT_CLASSES and kind != "object"),
    *_WORDS["known_things"],
)
OTHER_THINGS: Final = _WORDS["other_things"]
COLOUR_WORDS: Final = (*COLOURS, *_WORDS["colour_words"])
SIZE_WORDS: Final = _WORDS["size_words"]
ORDER_WORDS: Final = _WORDS["order_words"]
LOOK_WORDS: Final = _WORDS["look_words"]
PLACES: Final = _WORDS["places"]
SURFACES: Final = _WORDS["surfaces"]
CONTAINERS: Final = _WORDS["containers"]
NAMES: Final = _WORDS["names"]
PEOPLE: Final = (*NAMES, *_WORDS["people"])
COUNTRIES: Final = _WORDS["countries"]
FOODS: Final = _WORDS["foods"]
POSES: Final = _WORDS["poses"]
SAYINGS: Final = _WORDS["sayings"]
DOUBLING: Final = frozenset(_WORDS["doubling"])


def invented(random: Random) -> str:
    """Return a word that no list has, so that copying is learnt rather than words."""
    syllables = random.choice((1, 2, 2, 3))
    parts = ("onsets", "vowels", "codas")
    return "".join(random.choice(_WORDS[part]) for _ in range(syllables) for part in parts)
