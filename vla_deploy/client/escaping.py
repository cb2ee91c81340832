"""Escape in texts from outside what would control a terminal, or turn the direction of text."""

import unicodedata
from typing import Any, Final

_KEPT: Final = "\n\t"
# Control characters, line ends that are none here, and what turns the direction of text.
_CATEGORIES: Final = frozenset({"Cc", "Zl", "Zp", "Cs"})
_DIRECTIONS: Final = frozenset(
    "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
)


def escaped(text: str) -> str:
    """Return a text with every character that controls a terminal written as in Python: `\\x1b`."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(map(_escaped_letter, text))


def _escaped_letter(letter: str) -> str:
    if letter in _KEPT:
        return letter
    is_control = unicodedata.category(letter) in _CATEGORIES or letter in _DIRECTIONS
    return letter.encode("unicode_escape").decode() if is_control else letter


def escaped_document(document: Any) -> Any:
    """Return a document of JSON with every text in it escaped, for a program that draws."""
    if isinstance(document, str):
        return escaped(document)
    if isinstance(document, dict):
        return {escaped(key): escaped_document(value) for key, value in document.items()}
    return [*map(escaped_document, document)] if isinstance(document, list) else document
