"""Say what the command parser may answer: steps, their fields, and the words that it may copy.

What is closed (left, on) comes from a table; everything else is copied from the command, word by
word, so the model cannot name a thing or place that nobody said.
"""

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

# Fields whose words are copied. A value begins with a space: then a word at its beginning is the
# same token as in the command, which makes copying easy to learn.
COPIED_FIELDS: Final = frozenset(
    {"what", "where", "from", "to", "by", "text", "name", "except", "else"}
)
# What stands for words that were not said: "come here" goes to "me".
CHARGING: Final = "charging station"
IMPLIED: Final = ("me", "back", CHARGING)
MOST_STEPS: Final = 6

_ARMS: Final = ("left", "right")
_WAYS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "look": ("ahead", "left", "right", "up", "down"),
        "move": ("forward", "backward"),
        "turn": ("left", "right", "around"),
    }
)
RELATIONS: Final = (
    "in", "on", "to", "under", "next to", "near", "behind", "in front of", "left of", "right of",
)  # fmt: skip
SUBJECTS: Final = ("holding", "seeing", "place", "doing", "able")
# The fields of each step in their order; those in brackets may be missing.
STEPS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "go": ("where", "[else]"),
        "pick": ("what", "[except]", "[else]", "[from]", "[arm]"),
        "put": ("what", "[except]", "[else]", "[from]", "[how]", "[where]"),
        "bring": ("what", "[except]", "[else]", "[from]", "[to]"),
        "give": (),
        "find": ("what", "[else]", "[from]"),
        "see": ("what", "[from]"),
        "where": ("what",),
        "look": ("[way]", "[what]"),
        "move": ("way", "[by]"),
        "turn": ("way", "[by]"),
        "open": ("[arm]", "[what]"),
        "close": ("[arm]",),
        "pose": ("name", "[arm]"),
        "say": ("text",),
        "wait": ("[by]",),
        "stop": (),
        "ask": ("about",),
        "tidy": ("[where]", "[except]"),
        "await": (),
        "forbid": ("[what]", "[where]"),
        "permit": ("[what]", "[where]"),
        "nothing": (),
        "impossible": (),
        "unknown": (),
    }
)
JsonSchema = dict[str, Any]
_COPIED: Final[JsonSchema] = {"$ref": "#/$defs/copied"}
Step = Mapping[str, str]


def answer_schema(words: Sequence[str]) -> JsonSchema:
    """Return the JSON Schema of an answer to a command of these words."""
    copied = {"type": "string", "pattern": f"^(?:{_copied(words)})$"}
    return {
        "$defs": {"copied": copied},
        "type": "object",
        "properties": {
            "steps": {
                "type": "array",
                "items": {"anyOf": [*map(_step_schema, STEPS)]},
                "minItems": 1,
                "maxItems": MOST_STEPS,
            }
        },
        "required": ["steps"],
        "additionalProperties": False,
    }


def _copied(words: Sequence[str]) -> str:
    """Return the pattern of what may be copied: some of the words in their order, each once."""
    in_order = "".join(f"( {re.escape(one)})?" for one in words)
    return "|".join((in_order, *(f" {one}" for one in IMPLIED)))


def field_names(do: str) -> tuple[tuple[str, bool], ...]:
    """Return each field of a step in its order, and whether the step must have it."""
    return tuple((name.strip("[]"), not name.startswith("[")) for name in STEPS[do])


def _step_schema(do: str) -> JsonSchema:
    closed = {"arm": _ARMS, "how": RELATIONS, "about": SUBJECTS, "way": _WAYS.get(do, ())}
    fields = field_names(do)
    given = {
        name: _COPIED if name in COPIED_FIELDS else {"enum": list(closed[name])}
        for name, _ in fields
    }
    return {
        "type": "object",
        "properties": {"do": {"const": do}, **given},
        "required": ["do", *(name for name, is_needed in fields if is_needed)],
        "additionalProperties": False,
    }
