"""Turn what people, things and memories are called into data that no prompt can be broken by."""

import json
import unicodedata
from typing import Any, Final

NAME_CHARACTERS: Final = 60
SENTENCE_CHARACTERS: Final = 200
_LOOKED_AT: Final = 4  # times as much as may be left when white space is folded
# No text in the data can end the data: what could is written as an escape of JSON.
_ESCAPES: Final = {ord("<"): "\\u003c", ord(">"): "\\u003e", ord("&"): "\\u0026"}


def plain(text: object, most: int = NAME_CHARACTERS) -> str:
    """Return a text on one line, without control and invisible characters, and bounded."""
    visible = "".join(
        one
        for one in str(text)[: _LOOKED_AT * most]
        if one.isspace() or not unicodedata.category(one).startswith("C")
    )
    return " ".join(visible.split())[:most]


def as_data(document: Any) -> str:
    """Return JSON of ASCII alone, in which nothing looks like a tag."""
    return json.dumps(document, separators=(",", ":")).translate(_ESCAPES)
