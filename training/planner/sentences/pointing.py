"""Name the small words that single a thing out: articles, relations, sides, rows, amounts."""

from typing import Final

from training.planner.sentences.lists import read_lists

_POINTING: Final = read_lists("pointing")
ARTICLES: Final = _POINTING["articles"]
# Where a thing stands; "the" is left out of what is copied.
NEAR: Final = _POINTING["near"]
# What says only how exactly: "right next to", "over by".
LEADING: Final = frozenset({"just", "up", "down", "over", "right", "directly", "back"})
CLAUSES: Final = _POINTING["clauses"]
SIDES: Final = _POINTING["sides"]
TAILS: Final = _POINTING["tails"]
PRONOUNS: Final = _POINTING["pronouns"]
# Before several of which one is meant.
OF_WHICH: Final = _POINTING["of_which"]
# Before several, and before one.
QUANTITIES: Final = _POINTING["quantities"]
SINGLES: Final = _POINTING["singles"]
COMPARED: Final = _POINTING["compared"]
OF_SEVERAL: Final = _POINTING["of_several"]
ROWS: Final = _POINTING["rows"]
ORDINALS: Final = _POINTING["ordinals"]
NUMBERED: Final = _POINTING["numbered"]
DISTANCES: Final = _POINTING["distances"]
CLOSEST: Final = _POINTING["closest"]
BUT: Final = _POINTING["but"]
BUT_COLOUR: Final = _POINTING["but_colour"]
PARTS: Final = _POINTING["parts"]
# Left out of what is copied: code puts those back that tell how many.
DROPPED: Final = frozenset(_POINTING["dropped"])
