"""Write to the terminal what it may show: names and logs from outside control nothing there."""

import sys
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, TextIO, cast

CLEAR_SCREEN: Final = "\x1b[H\x1b[2J"
CLEAR_LINE: Final = "\r\x1b[K"
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


class EscapingStream:
    """Write to another stream, with what controls a terminal escaped."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write a text."""
        self.stream.write(escaped(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def plain(stream: TextIO) -> TextIO:
    """Return the stream beneath, for a program that draws: what it shows, it escapes itself."""
    return stream.stream if isinstance(stream, EscapingStream) else stream


def control(sequence: str, stream: TextIO | None = None) -> None:
    """Write one of the command line's own sequences, to standard output unless another is given."""
    plain(sys.stdout if stream is None else stream).write(sequence)


@contextmanager
def escaping_output() -> Iterator[None]:
    """Escape what is printed, to standard output and standard error, in this block."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (cast("TextIO", EscapingStream(one)) for one in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
