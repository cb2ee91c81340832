"""Tables of hand-written files are checked as declared, and become the dataclasses meant."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import pytest

from vla_deploy.runtime.table_schema import (
    TEXT,
    ValueCheck,
    build,
    check_record,
    check_tables,
    integer,
    number,
    numbers,
    one_of,
)


@pytest.mark.parametrize(
    ("check", "good", "bad"),
    [
        (integer(0, 3), (0, 3), (-1, 4, 1.0, True, "1", None)),
        (integer(1), (1, 10**9), (0, math.inf)),
        (number(0, 1), (0, 0.5, 1), (-0.1, 1.1, math.nan, True, "0")),
        (numbers(2), ([0, 1.5],), ([0], [0, 1, 2], [0, math.inf], [0, True], "01")),
        (one_of("a", 2), ("a", 2), ("b", [])),
        (TEXT, ("a",), ("", 3)),
    ],
)
def test_values_are_checked(check: ValueCheck, good: tuple[Any, ...], bad: tuple[Any, ...]) -> None:
    assert [check.holds(value) for value in (*good, *bad)] == [True] * len(good) + [False] * len(
        bad
    )


def test_every_fault_of_a_table_is_listed() -> None:
    shape = {"name": TEXT, "count": integer(1), "note": TEXT.optional}
    faults = check_record({"count": 0, "colour": "red"}, "thing", shape)
    assert [str(fault) for fault in faults] == [
        "thing.name: got nothing, expected a text of one line",
        "thing.colour: got an unknown key, expected one of name, count, note",
        "thing.count: got 0, expected an integer of 1 or more",
    ]


def test_tables_are_found_by_their_paths() -> None:
    shape = {"name": TEXT}
    document = {
        "one": {"inner": {}, "rows": [{}, {"name": "a"}, 3]},
        "named": {"first": {"views": [{}]}, "second": 3},
    }
    paths = ("one", "one.inner", "one.rows", "named.*", "named.*.views", "absent", "absent.*.rows")
    faults = [fault.key for fault in check_tables(document, dict.fromkeys(paths, shape))]
    assert [key for key in faults if key.endswith(".name")] == [
        "one.name",
        "one.inner.name",
        "one.rows[0].name",
        "named.first.name",
        "named.second.name",
        "named.first.views[0].name",
    ]


class Kind(StrEnum):
    BOX = "box"


@dataclass(frozen=True, kw_only=True)
class Part:
    kind: Kind
    corners_m: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Whole:
    part: Part
    parts: tuple[Part, ...] = ()
    by_kind: Mapping[Kind, Part] = field(default_factory=dict)
    size: int | str
    spare: Part | None = None


def test_a_table_becomes_the_dataclass_that_it_describes() -> None:
    box = {"kind": "box", "corners_m": [[0, 1], [2, 3]], "a key of an earlier release": 1}
    built = build(Whole, {"part": box, "parts": [box], "by_kind": {"box": box}, "size": "free"})
    part = Part(kind=Kind.BOX, corners_m=((0.0, 1.0), (2.0, 3.0)))
    assert built == Whole(part=part, parts=(part,), by_kind={Kind.BOX: part}, size="free")
    assert built.part.kind is Kind.BOX
    assert type(built.part.corners_m[0][0]) is float
