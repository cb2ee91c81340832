"""Follow a path through a topic's document to the values of a metric, and collect their labels."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

LONGEST_LABEL: Final = 64
Found = tuple[Any, tuple[object, ...]]
"""A value, and the values of the labels that its step adds."""


@dataclass(frozen=True, slots=True)
class PathStep:
    """Lead from a value to values inside it, to none where they are missing.

    `labels` names the labels that the step adds, `key` the last key that `keys` looks up.
    """

    follow: Callable[[Any], Iterator[Found]]
    labels: tuple[str, ...] = ()
    key: str = ""


Path = tuple[PathStep, ...]


@dataclass(frozen=True, slots=True)
class PathMatch:
    """Carry a value found in a document, and the values of its labels."""

    value: Any
    labels: tuple[str, ...] = ()


def keys(dotted: str) -> PathStep:
    """Return the step that looks up keys, written with dots between them."""
    names = dotted.split(".")

    def follow(value: Any) -> Iterator[Found]:
        for name in names:
            if not isinstance(value, Mapping) or name not in value:
                return
            value = value[name]
        yield value, ()

    return PathStep(follow, key=names[-1])


def path(*steps: PathStep) -> tuple[Path, ...]:
    """Return the paths of a metric that has one."""
    return (steps,)


def at(dotted: str) -> tuple[Path, ...]:
    """Return the paths of a metric whose value is found by keys alone."""
    return path(keys(dotted))


def each(label: str, prefix: str = "") -> PathStep:
    """Return the step to every member of an object whose key has a prefix.

    The rest of the key is the label.
    """

    def follow(value: Any) -> Iterator[Found]:
        if isinstance(value, Mapping):
            for key, member in value.items():
                if key.startswith(prefix):
                    yield member, (key.removeprefix(prefix),)

    return PathStep(follow, (label,))


def among(label: str, key_of: Mapping[str, str]) -> PathStep:
    """Return the step to known keys, each under its own value of the label."""

    def follow(value: Any) -> Iterator[Found]:
        if isinstance(value, Mapping):
            yield from ((value[key], (name,)) for name, key in key_of.items() if key in value)

    return PathStep(follow, (label,))


def same(label: str, *names: str) -> PathStep:
    """Return the step to known keys, which are the label's values as well."""
    return among(label, {name: name for name in names})


def rows(columns: Mapping[str, str], **where: object) -> PathStep:
    """Return the step to the rows of a list that have all values of `where`.

    `columns` maps labels to columns. Null in a column stands for the whole robot: label "total".
    """

    def follow(value: Any) -> Iterator[Found]:
        if isinstance(value, Sequence):
            for row in value:
                if all(row.get(key) == wanted for key, wanted in where.items()):
                    names = (row.get(column) for column in columns.values())
                    yield row, tuple("total" if name is None else name for name in names)

    return PathStep(follow, tuple(columns))


def facts(*labels: str) -> PathStep:
    """Return the step that makes members of an object the labels of one value, always 1."""

    def follow(value: Any) -> Iterator[Found]:
        if isinstance(value, Mapping) and all(label in value for label in labels):
            yield 1, tuple(value[label] for label in labels)

    return PathStep(follow, labels)


def joints(key: str) -> PathStep:
    """Return the step to every item of an array in joint order, labelled by `joint_names`."""

    def follow(value: Any) -> Iterator[Found]:
        names, values = value.get("joint_names", ()), value.get(key, ())
        yield from ((one, (name,)) for name, one in zip(names, values, strict=False))

    return PathStep(follow, ("joint",))


def labels_of(path: Path) -> tuple[str, ...]:
    """Return the names of all labels on the way."""
    return tuple(label for step in path for label in step.labels)


def walk(path: Path, document: Any) -> list[PathMatch]:
    """Return everything that a path leads to."""
    matches = [PathMatch(document)]
    for step in path:
        matches = [
            PathMatch(value, (*match.labels, *(str(label)[:LONGEST_LABEL] for label in labels)))
            for match in matches
            for value, labels in step.follow(match.value)
        ]
    return matches
