"""Cut what is told of a situation to the room that a prompt has, by one written order."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.planning.prompts.quoting import as_data

# What is cut first, and how many rows of it are kept while anything after it can be cut. The first
# rows matter most: things that the command names, then the nearest; what was said last.
CUT_ORDER: Final[tuple[tuple[str, int], ...]] = (
    ("remembered", 0),
    ("gone", 0),
    ("things", 12),
    ("said_before", 1),
    ("failed_before", 1),
    ("things", 0),
    ("said_before", 0),
    ("failed_before", 0),
)
_COMMA: Final = 1

Rows = Sequence[Any]


def fitted(situation: Mapping[str, Any], room: int) -> dict[str, Any]:
    """Return a situation of at most `room` characters of data, its least important rows left out.

    Rows that were left out are counted under `left_out`. What is in no row of the order stays.
    """
    kept = {**situation, "left_out": situation.get("left_out", 0)}
    length = len(as_data(kept)) + len(str(sum(map(_count, kept.values()))))
    for name, least in CUT_ORDER:
        rows = list(kept.get(name, ()))
        while length > room and len(rows) > least:
            length -= len(as_data(rows.pop())) + _COMMA
            kept["left_out"] += 1
        if name in kept:
            kept[name] = rows
    return kept


def _count(value: object) -> int:
    return len(value) if isinstance(value, list) else 0
