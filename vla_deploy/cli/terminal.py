"""Write to the terminal what it may show: names and logs from outside control nothing there."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, TextIO, cast

from vla_deploy.client.escaping import escaped

CLEAR_SCREEN: Final = "\x1b[H\x1b[2J"
CLEAR_LINE: Final = "\r\x1b[K"


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
