"""Declare what the tables of a hand-written file hold; collect every fault, stop at none."""

import tomllib
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass, replace
from enum import Enum
from functools import cache
from math import inf, isfinite
from types import NoneType, UnionType
from typing import Any, Final, TypeGuard, TypeVar, cast, get_args, get_origin, get_type_hints

Built = TypeVar("Built")
LONGEST_LINE: Final = 1000
_SHOWN: Final = 400


@dataclass(frozen=True, slots=True, kw_only=True)
class TableFault:
    """Say what is wrong with one key of a file."""

    key: str
    got: str
    expected: str

    def __str__(self) -> str:
        expected = _short(self.expected, LONGEST_LINE)
        return f"{_short(self.key)}: got {_short(self.got)}, expected {expected}"


def _short(text: str, most: int = _SHOWN) -> str:
    """Return what a fault shows of a text that somebody wrote: its two ends where it is long."""
    return text if len(text) <= most else f"{text[: most // 2]}...{text[-most // 4 :]}"


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


def parse_toml(text: str) -> dict[str, Any]:
    """Return the document of a hand-written file; one that nests too deeply is no TOML, too.

    Raises:
        tomllib.TOMLDecodeError: it is no TOML.
    """
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("it is nested too deeply") from None


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


def is_line(value: object) -> TypeGuard[str]:
    """Return whether a value is a text of one line that may be said, shown and logged."""
    return isinstance(value, str) and value.isprintable() and len(value) <= LONGEST_LINE


TEXT = ValueCheck(
    expected="a text of one line",
    holds=lambda value: is_line(value) and value != "",
)
TABLE = ValueCheck(expected="a table", holds=lambda value: isinstance(value, dict))
TABLES = ValueCheck(
    expected="a list of tables",
    holds=lambda value: isinstance(value, list) and all(isinstance(row, dict) for row in value),
)
TEXTS = ValueCheck(
    expected="a list of texts",
    holds=lambda value: isinstance(value, list) and all(map(is_line, value)),
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


def check_tables(document: Mapping[str, Any], shapes: Mapping[str, Shape]) -> Iterator[TableFault]:
    """Yield the faults of each table that a document has at a path; `*` stands for any name."""
    for path, shape in shapes.items():
        for key, table in _tables_at(document, path):
            yield from check_record(table, key, shape)


def _tables_at(
    table: Mapping[str, Any], path: str, above: str = ""
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield tables with their keys: one, each of a list, or under `*` all that there are."""
    name, _, rest = path.partition(".")
    if name == "*":
        found = {one: inner if isinstance(inner, dict) else {} for one, inner in table.items()}
    elif isinstance(inner := table.get(name), list):
        rows = enumerate(inner)
        found = {f"{name}[{index}]": row for index, row in rows if isinstance(row, dict)}
    else:
        found = {name: inner} if isinstance(inner, dict) else {}
    for key, inner in found.items():
        where = f"{above}.{key}" if above else key
        if rest:
            yield from _tables_at(inner, rest, where)
        else:
            yield where, inner


def build(kind: type[Built], record: Mapping[str, Any]) -> Built:
    """Return a table without faults as a dataclass; absent keys keep its defaults, others go."""
    types = _types_of(cast("Hashable", kind))
    return kind(**{key: _value(types[key], one) for key, one in record.items() if key in types})


@cache
def _types_of(kind: Hashable) -> dict[str, Any]:
    return get_type_hints(kind)


def _value(kind: Any, value: Any) -> Any:
    """Return a value as its type says: lists as tuples, tables as dataclasses, words as enums."""
    choices = [one for one in get_args(kind) if one is not NoneType]
    origin = get_origin(kind)
    if origin is UnionType:
        return _value(choices[0], value) if len(choices) == 1 else value
    if origin is tuple:
        return tuple(_value(choices[0], one) for one in value)
    if origin is Mapping:
        return {_value(choices[0], key): _value(choices[1], one) for key, one in value.items()}
    if is_dataclass(kind):
        return build(kind, value)  # type: ignore[arg-type]
    return kind(value) if kind is float or issubclass(kind, Enum) else value
