"""Declare what the tables of a hand-written file hold; collect every fault, stop at none."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any, TypeGuard


@dataclass(frozen=True, slots=True, kw_only=True)
class TableFault:
    """Say what is wrong with one key of a file."""

    key: str
    got: str
    expected: str

    def __str__(self) -> str:
        return f"{self.key}: got {self.got}, expected {self.expected}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValueCheck:
    """Say what a value must be, in words and as a test."""

    expected: str
    holds: Callable[[Any], bool]
    is_optional: bool = False

    @property
    def optional(self) -> "ValueCheck":
        """Return the same check of a key that may be absent."""
        return replace(self, is_optional=True)


Shape = Mapping[str, ValueCheck]


def is_number(value: object) -> TypeGuard[int | float]:
    """Return whether a value is a finite number; TOML's booleans are none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def number(low: float, high: float, unit: str = "", kind: str = "a number") -> ValueCheck:
    """Return the check that a value is a number within bounds."""
    return ValueCheck(
        expected=f"{kind} in {low:g}..{high:g} {unit}".rstrip(),
        holds=lambda value: is_number(value) and low <= value <= high,
    )


def integer(low: int, high: float = inf) -> ValueCheck:
    """Return the check that a value is an integer within bounds."""
    return ValueCheck(
        expected=f"an integer of {low} or more" if high == inf else f"an integer in {low}..{high}",
        holds=lambda value: is_number(value) and isinstance(value, int) and low <= value <= high,
    )


def one_of(*choices: Any) -> ValueCheck:
    """Return the check that a value is one of `choices`."""
    listed = ", ".join(str(choice) for choice in choices)
    return ValueCheck(expected=f"one of {listed}", holds=lambda value: value in choices)


def numbers(count: int) -> ValueCheck:
    """Return the check that a value is a list of so many numbers."""
    return ValueCheck(
        expected=f"a list of {count} numbers",
        holds=lambda value: (
            isinstance(value, list) and len(value) == count and all(map(is_number, value))
        ),
    )


NUMBER = ValueCheck(expected="a number", holds=is_number)
POSITIVE = ValueCheck(
    expected="a number above 0", holds=lambda value: is_number(value) and value > 0
)
TEXT = ValueCheck(expected="a text", holds=lambda value: isinstance(value, str) and value != "")
TABLE = ValueCheck(expected="a table", holds=lambda value: isinstance(value, dict))
TABLES = ValueCheck(
    expected="a list of tables",
    holds=lambda value: isinstance(value, list) and all(isinstance(row, dict) for row in value),
)
TEXTS = ValueCheck(
    expected="a list of texts",
    holds=lambda value: isinstance(value, list) and all(isinstance(row, str) for row in value),
)


def check_record(record: Mapping[str, Any], key: str, shape: Shape) -> tuple[TableFault, ...]:
    """Return the faults of one table: missing keys, unknown keys, values of the wrong kind."""
    prefix = f"{key}." if key else ""
    missing = [
        TableFault(key=prefix + name, got="nothing", expected=check.expected)
        for name, check in shape.items()
        if name not in record and not check.is_optional
    ]
    unknown = [
        TableFault(key=prefix + name, got="an unknown key", expected=f"one of {', '.join(shape)}")
        for name in record
        if name not in shape
    ]
    wrong = [
        TableFault(key=prefix + name, got=repr(record[name]), expected=check.expected)
        for name, check in shape.items()
        if name in record and not check.holds(record[name])
    ]
    return (*missing, *unknown, *wrong)
