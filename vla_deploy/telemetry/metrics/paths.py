"""Lead through a told document to the values of a metric, and name their labels on the way."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

LONGEST_LABEL: Final = 64


@dataclass(frozen=True, slots=True)
class Place:
    """Stand somewhere in a document: what is told there, and the label values up to it."""

    told: Any
    labels: tuple[str, ...] = ()

    def at(self, told: Any, *labels: object) -> "Place":
        """Return a place further inside."""
        return Place(told, (*self.labels, *(str(label)[:LONGEST_LABEL] for label in labels)))


class Step(Protocol):
    """Go on from one place to others; to none, where the document does not tell."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the names of the labels that this step adds."""
        ...

    def go(self, place: Place) -> Iterator[Place]:
        """Yield the places that this step leads to."""
        ...


Path = tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class At:
    """Follow keys."""

    keys: tuple[str, ...]
    labels: tuple[str, ...] = ()

    def go(self, place: Place) -> Iterator[Place]:
        """Yield what the last key has."""
        told = place.told
        for key in self.keys:
            if not isinstance(told, Mapping) or key not in told:
                return
            told = told[key]
        yield place.at(told)


@dataclass(frozen=True, slots=True)
class Named:
    """Follow one key, and label what is there by a name of our own."""

    key: str
    label: str
    name: str

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the one label."""
        return (self.label,)

    def go(self, place: Place) -> Iterator[Place]:
        """Yield what the key has."""
        if isinstance(place.told, Mapping) and self.key in place.told:
            yield place.at(place.told[self.key], self.name)


@dataclass(frozen=True, slots=True)
class Each:
    """Follow every key of an object; the key, less a prefix that all must have, is the label."""

    label: str
    prefix: str = ""

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the one label."""
        return (self.label,)

    def go(self, place: Place) -> Iterator[Place]:
        """Yield every member."""
        if not isinstance(place.told, Mapping):
            return
        for key, told in place.told.items():
            if key.startswith(self.prefix):
                yield place.at(told, key.removeprefix(self.prefix))


@dataclass(frozen=True, slots=True)
class Among:
    """Follow keys that are known beforehand, each by its label value; those not told are left."""

    label: str
    keys: Mapping[str, str]

    @property
    def labels(self) -> tuple[str, ...]:
        """Return the one label."""
        return (self.label,)

    def go(self, place: Place) -> Iterator[Place]:
        """Yield every member that is told."""
        if not isinstance(place.told, Mapping):
            return
        for name, key in self.keys.items():
            if key in place.told:
                yield place.at(place.told[key], name)


@dataclass(frozen=True, slots=True)
class Rows:
    """Follow every row of a list that has what `where` asks; columns of it are the labels.

    A null column is the whole robot's: its label is "total".
    """

    columns: Mapping[str, str]
    where: tuple[tuple[str, object], ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Return a label for each column."""
        return tuple(self.columns)

    def go(self, place: Place) -> Iterator[Place]:
        """Yield the rows."""
        if not isinstance(place.told, Sequence):
            return
        for row in place.told:
            if all(row.get(key) == wanted for key, wanted in self.where):
                names = (row.get(column) for column in self.columns.values())
                yield place.at(row, *("total" if name is None else name for name in names))


@dataclass(frozen=True, slots=True)
class Facts:
    """Take facts of an object as the labels of one value that is always 1."""

    labels: tuple[str, ...]

    def go(self, place: Place) -> Iterator[Place]:
        """Yield the one place, where every fact is told."""
        if isinstance(place.told, Mapping) and all(label in place.told for label in self.labels):
            yield place.at(1, *(place.told[label] for label in self.labels))


@dataclass(frozen=True, slots=True)
class Joints:
    """Follow an array in joint order; the joints' names come with the document."""

    key: str
    labels: tuple[str, ...] = ("joint",)

    def go(self, place: Place) -> Iterator[Place]:
        """Yield the value of every joint."""
        names, told = place.told.get("joint_names", ()), place.told.get(self.key, ())
        for name, value in zip(names, told, strict=False):
            yield place.at(value, name)


def keys(dotted: str) -> At:
    """Return the step that follows keys, written with dots between them."""
    return At(tuple(dotted.split(".")))


def same(label: str, *names: str) -> Among:
    """Return the step that follows keys which are the label values, too."""
    return Among(label, {name: name for name in names})


def labels_of(path: Path) -> tuple[str, ...]:
    """Return the names of all labels on the way."""
    return tuple(label for step in path for label in step.labels)


def walk(path: Path, document: Any) -> list[Place]:
    """Return every place that a path leads to."""
    places = [Place(document)]
    for step in path:
        places = [found for place in places for found in step.go(place)]
    return places
