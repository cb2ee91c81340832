"""List the verbs of commands."""

from collections.abc import Mapping
from typing import Final

DOING: Final = {
    "bringing": "bring", "carrying": "carry", "checking": "check", "clearing": "clear",
    "closing": "close", "coming": "come", "driving": "drive", "dropping": "drop",
    "fetching": "fetch", "finding": "find", "getting": "get", "giving": "give", "going": "go",
    "grabbing": "grab", "handing": "hand", "heading": "head", "holding": "hold",
    "leaving": "leave", "lifting": "lift", "looking": "look", "moving": "move",
    "opening": "open", "passing": "pass", "picking": "pick", "placing": "place",
    "popping": "pop", "putting": "put", "returning": "return", "saying": "say",
    "setting": "set", "showing": "show", "sticking": "stick", "taking": "take",
    "telling": "tell", "tidying": "tidy", "turning": "turn", "waiting": "wait",
}  # fmt: skip
"""How verbs of commands are said behind "would you mind"."""

FORMS: Final[Mapping[str, str]] = {
    form: verb
    for verb, forms in {
        "go": "go going gone went", "drive": "drive driving driven drove",
        "come": "come coming came", "move": "move moving moved", "return": "return returning "
        "returned", "turn": "turn turning turned", "put": "put putting", "place": "place placing "
        "placed", "set": "set setting", "drop": "drop dropping dropped", "leave": "leave leaving "
        "left", "pick": "pick picking picked", "take": "take taking taken took",
        "grab": "grab grabbing grabbed", "get": "get getting got gotten", "fetch": "fetch "
        "fetching fetched", "bring": "bring bringing brought", "give": "give giving given gave",
        "carry": "carry carrying carried", "find": "find finding found", "look": "look looking "
        "looked", "search": "search searching searched", "check": "check checking checked",
        "tidy": "tidy tidying tidied", "clear": "clear clearing cleared", "open": "open opening "
        "opened", "close": "close closing closed", "say": "say saying said", "visit": "visit "
        "visiting visited", "deliver": "deliver delivering delivered", "stow": "stow stowing "
        "stowed", "store": "store storing stored", "tuck": "tuck tucking tucked", "throw":
        "throw throwing thrown threw",
    }.items()
    for form in forms.split()
}  # fmt: skip
"""Each form of such a verb, with the one for a command."""


def any_verb(*others: str) -> str:
    """Return the part of a pattern that finds any of them, or one of some others."""
    return "|".join(sorted({*DOING.values(), *others}))
