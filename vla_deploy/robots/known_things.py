"""Describe the things whose size is known: a camera without depth places things by them."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownThing:
    """Give a kind of thing its size: length, width and height as it stands."""

    class_name: str
    size_m: tuple[float, float, float]


def read_things(rows: list[Mapping[str, Any]]) -> tuple[KnownThing, ...]:
    """Return the things of a robot file that has no faults."""
    return tuple(KnownThing(class_name=row["class"], size_m=tuple(row["size_m"])) for row in rows)
