"""Read profile files with what they inherit, and remember where each value stands."""

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from platforms.errors import ProfileError

PROFILES: Final = Path(__file__).parent / "profiles"
Table = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileSource:
    """Hold a profile as it stands in its files; `origins` says which file set each dotted key.

    `parents` are what it inherits from, the nearest first.
    """

    name: str
    path: Path
    values: Table
    origins: Mapping[str, Path]
    parents: tuple[str, ...] = ()

    @classmethod
    def of_values(cls, name_or_path: str, values: Table) -> "ProfileSource":
        """Return what another process has read."""
        path = Path(name_or_path)
        return cls(name=path.stem, path=path, values=values, origins={})

    def file_of(self, key: str) -> Path:
        """Return the file that a value stands in, or the profile's own for one that is missing."""
        return self.origins.get(key.partition("[")[0], self.path)


def read_source(name_or_path: str | Path) -> ProfileSource:
    """Read a profile by its name, or by a path that ends in .toml, and merge what it inherits.

    Raises:
        ProfileError: a file is missing or no TOML, a parent is unknown, or it is its own.
    """
    path = _locate(str(name_or_path))
    chain = _chain(path)
    values: dict[str, Any] = {}
    origins: dict[str, Path] = {}
    for file, document in reversed(chain):
        own = {key: value for key, value in document.items() if key != "inherits"}
        values = merged(values, own)
        origins |= dict.fromkeys((key for key, _ in flat(own)), file)
    parents = tuple(file.stem for file, _ in chain[1:])
    return ProfileSource(name=path.stem, path=path, values=values, origins=origins, parents=parents)


def flat(table: Table, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every value with its dotted key; lists count as one value."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _chain(path: Path) -> list[tuple[Path, Table]]:
    """Return the profile's file and those it inherits from, the eldest last."""
    chain: list[tuple[Path, Table]] = []
    while True:
        if any(path.resolve() == seen.resolve() for seen, _ in chain):
            circle = " -> ".join([*(seen.stem for seen, _ in chain), path.stem])
            raise ProfileError((f"{chain[0][0]}: inherits: expected an end, got {circle}",))
        document = _parse(path)
        chain.append((path, document))
        if "inherits" not in document:
            return chain
        path = _parent(path, document["inherits"])


def _parse(path: Path) -> Table:
    try:
        return tomllib.loads(path.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError, RecursionError) as error:
        raise ProfileError((f"{path}: expected a TOML file: {error}",)) from error


def _parent(path: Path, name: object) -> Path:
    """Find a parent beside the file, else among those that come with the software."""
    if not isinstance(name, str) or not name or "/" in name:
        raise ProfileError((f"{path}: inherits: expected the name of a profile, got {name!r}",))
    for folder in (path.parent, PROFILES):
        parent = folder / f"{name}.toml"
        if parent.is_file():
            return parent
    raise ProfileError((f"{path}: inherits: expected {_known(path.parent)}, got {name!r}",))


def _locate(name: str) -> Path:
    if name.endswith(".toml"):
        return Path(name)
    path = PROFILES / f"{name}.toml"
    if "/" in name or not path.is_file():
        known = _known(PROFILES)
        raise ProfileError((f"no profile {name!r}: choose {known}, or give a path to a .toml",))
    return path


def _known(folder: Path) -> str:
    names = {path.stem for place in (folder, PROFILES) for path in place.glob("*.toml")}
    return ", ".join(sorted(names))


def merged(below: Table, above: Table) -> dict[str, Any]:
    """Merge tables key by key; every other value above, lists too, replaces the one below."""
    whole = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(whole.get(key), dict)
        whole[key] = merged(whole[key], value) if both else value
    return whole
