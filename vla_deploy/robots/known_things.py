"""Describe what an owner says of things: their size, and what they are called in this home.

A camera without depth places things by their size.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vla_deploy.runtime.table_schema import TEXT, Shape, ValueCheck, is_number

SIZE = ValueCheck(
    expected="length, width and height above 0 in m, such as [0.025, 0.025, 0.025]",
    holds=lambda value: (
        isinstance(value, list)
        and len(value) == 3
        and all(is_number(one) and one > 0.0 for one in value)
    ),
)
THING: Shape = {"class": TEXT, "size_m": SIZE}
WORD: Shape = {"said": TEXT, "means": TEXT}


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownThing:
    """Give a kind of thing its size: length, width and height as it stands."""

    class_name: str
    size_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnWord:
    """Say what a word, or a few, stand for in this home: "thermos", "green bottle"."""

    said: str
    means: str


def read_things(rows: list[Mapping[str, Any]]) -> tuple[KnownThing, ...]:
    """Return the things of a robot file that has no faults."""
    return tuple(KnownThing(class_name=row["class"], size_m=tuple(row["size_m"])) for row in rows)
