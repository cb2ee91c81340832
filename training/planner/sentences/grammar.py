"""Expand patterns of phrases: "(pick|lift) [up] {what}" gives words and slots by chance.

(a|b)    one of them, also nothing
[a|b]    one of them or nothing
{name}   a slot; {field:source} fills a field of the plan from a source of words
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from random import Random
from typing import Final

_TOKEN: Final = re.compile(r"\{[a-z_:]+\}|[()\[\]|]|[^\s()\[\]|{}]+")
_CLOSING: Final = {"(": ")", "[": "]"}


class PatternInvalid(ValueError):
    """Say where a pattern is no pattern."""


@dataclass(frozen=True, slots=True)
class Slot:
    """Mark the place of something to fill in; `field` is empty where the plan has none of it."""

    field: str
    source: str


@dataclass(frozen=True, slots=True)
class Choice:
    """Give one of several sequences."""

    options: tuple["Sequence", ...]


Part = str | Slot | Choice
Sequence = tuple[Part, ...]


def parse(pattern: str) -> Sequence:
    """Read a pattern.

    Raises:
        PatternInvalid: a bracket is open, or closed too often.
    """
    tokens = _TOKEN.findall(pattern)
    options, rest = _options(tokens, 0, "")
    if rest != len(tokens) or len(options) != 1:
        raise PatternInvalid(f"{pattern!r}: expected one sequence, stopped at token {rest}")
    return options[0]


def _options(tokens: list[str], at: int, closing: str) -> tuple[tuple[Sequence, ...], int]:
    """Read sequences divided by bars, up to the closing bracket or the end."""
    options: list[Sequence] = []
    parts: list[Part] = []
    while at < len(tokens) and tokens[at] != closing:
        token = tokens[at]
        at += 1
        if token == "|" and closing:
            options.append(tuple(parts))
            parts = []
        elif token in _CLOSING:
            inner, at = _options(tokens, at, _CLOSING[token])
            if at >= len(tokens):
                raise PatternInvalid(f"{' '.join(tokens)!r}: a {token!r} is never closed")
            at += 1
            parts.append(Choice(inner if token == "(" else (*inner, ())))
        elif token in ")]|":
            raise PatternInvalid(f"{' '.join(tokens)!r}: {token!r} has no opening bracket")
        else:
            parts.append(_slot(token) if token.startswith("{") else token)
    return (*options, tuple(parts)), at


def _slot(token: str) -> Slot:
    field, _, source = token[1:-1].partition(":")
    return Slot(field, source or field)


def expand(sequence: Sequence, random: Random) -> Iterator[str | Slot]:
    """Yield words and slots of one of a pattern's forms."""
    for part in sequence:
        if isinstance(part, Choice):
            yield from expand(random.choice(part.options), random)
        else:
            yield part


def slots_of(sequence: Sequence) -> Iterator[Slot]:
    """Yield every slot that a pattern may give."""
    for part in sequence:
        if isinstance(part, Slot):
            yield part
        elif isinstance(part, Choice):
            for option in part.options:
                yield from slots_of(option)
