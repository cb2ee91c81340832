"""Read a request's head: the little that the stop door needs of HTTP/1.1."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final
from urllib.parse import urlsplit

_LINE_END: Final = re.compile(r"\r?\n")
_KNOWN: Final = frozenset({"host", "origin", "accept"})
_PAGE: Final = "text/html"
_ORIGIN: Final = re.compile(r"https?://[A-Za-z0-9._:\[\]-]+")  # it is written into an answer


class Malformed(Exception):
    """Say why a request is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Hold what matters of one request; its body, if any, changes nothing."""

    method: str
    path: str
    host: str = ""
    origin: str = ""
    accept: str = ""

    @property
    def is_press(self) -> bool:
        """Tell whether this is a demand to stop the robot."""
        return (self.method, self.path) == ("POST", "/stop")

    @property
    def wants_page(self) -> bool:
        """Tell whether a person's browser shows the answer, and no script reads it."""
        return _PAGE in self.accept

    @property
    def allowed_origin(self) -> str:
        """Return the origin whose scripts may read the answer: any port of the same host, or ""."""
        if not _ORIGIN.fullmatch(self.origin):
            return ""
        here, there = _host_name(f"//{self.host}"), _host_name(self.origin)
        return self.origin if here and here == there else ""

    @property
    def foreign_origin(self) -> str:
        """Return the origin of another host's page, or "" where there is none."""
        return "" if self.allowed_origin else self.origin


def read_head(head: bytes) -> Request:
    """Return the request of a head, which may be cut off after its first line.

    Headers that are none are left out: one request a connection, so nothing can hide in them.

    Raises:
        Malformed: the first line is not that of HTTP/1.x.
    """
    first, *rest = _LINE_END.split(head.decode("latin-1"))
    words = first.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise Malformed(f"request line {first[:60]!r}: expected METHOD PATH HTTP/1.1")
    return Request(method=words[0], path=words[1].partition("?")[0], **dict(_headers(rest)))


def _headers(lines: list[str]) -> Iterator[tuple[str, str]]:
    for line in lines:
        name, _, value = line.partition(":")
        if name.lower() in _KNOWN:
            yield name.lower(), value.strip()


def _host_name(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:  # an address in brackets that is none: nobody's host
        return ""
