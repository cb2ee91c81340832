"""List the verbs of commands."""

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


def any_verb(*others: str) -> str:
    """Return the part of a pattern that finds any of them, or one of some others."""
    return "|".join(sorted({*DOING.values(), *others}))
