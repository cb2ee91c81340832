"""Find the JSON that a model was asked for in what it wrote."""

import json
import re
from typing import Any, Final, NoReturn

from vla_deploy.model_servers.errors import AnswerEmpty, AnswerMalformed

# What a model thinks aloud is not its answer, and may hold drafts of one.
_THINKING: Final = re.compile(r"\A\s*<think(?:ing)?>.*?(?:</think(?:ing)?>|\Z)", re.DOTALL)
_BEGINNING: Final = re.compile(r'\{\s*["}]')
# Each costs the parser a look at all the text before it.
_MOST_BEGINNINGS: Final = 64
_DEEPEST: Final = 64


def strict_json(text: str) -> Any:
    """Parse a JSON text that holds nothing else.

    Raises:
        ValueError: it is no JSON of RFC 8259, or nested too deeply.
    """
    try:
        return _DECODER.decode(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def objects_in(text: str) -> list[dict[str, Any]]:
    """Return the JSON objects in a model's text, in their order; prose around them is left out.

    An object that is broken is skipped whole: none of its parts is taken for an answer.

    Raises:
        AnswerEmpty: there is no text.
        AnswerMalformed: there is no JSON object in it.
    """
    if not text.strip():
        raise AnswerEmpty("the model answered with no text")
    said = _THINKING.sub("", text)
    found, start = [], 0
    for _ in range(_MOST_BEGINNINGS):
        beginning = _BEGINNING.search(said, start)
        if beginning is None:
            break
        value, start = _decode(said, beginning.start())
        if value is not None:
            found.append(value)
    if not found:
        raise AnswerMalformed(f"expected a JSON object in the answer, got {text.strip()!r:.120}")
    return found


def _decode(text: str, start: int) -> tuple[dict[str, Any] | None, int]:
    """Return the object that begins at `start`, if one does, and where to look on."""
    try:
        value, end = _DECODER.raw_decode(text, start)
    except json.JSONDecodeError as error:
        # A string that never ends holds all that follows; the error says where it begins.
        is_endless = error.msg.startswith("Unterminated string")
        return None, len(text) if is_endless else max(error.pos, start + 1)
    except (ValueError, RecursionError):  # a number too long, NaN, or nested too deeply
        return None, len(text)
    return (value if _depth(value) <= _DEEPEST else None), end


def _depth(value: Any) -> int:
    """Return how deeply a value is nested, without recursion."""
    deepest, left = 0, [(value, 1)]
    while left:
        inner, depth = left.pop()
        deepest = max(deepest, depth)
        if isinstance(inner, dict):
            left += [(one, depth + 1) for one in inner.values()]
        elif isinstance(inner, list):
            left += [(one, depth + 1) for one in inner]
    return deepest


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")


_DECODER: Final = json.JSONDecoder(parse_constant=_no_number)
