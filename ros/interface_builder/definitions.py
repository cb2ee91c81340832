"""Read interface packages: their definition files, and which packages those need."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from interface_builder.errors import DefinitionsInvalid

KINDS: Final = ("action", "msg", "srv")
# What every definition of a kind needs beside the types that its fields name.
_IMPLICIT: Mapping[str, frozenset[str]] = {
    "action": frozenset(
        {"action_msgs", "service_msgs", "unique_identifier_msgs", "builtin_interfaces"}
    ),
    "srv": frozenset({"service_msgs", "builtin_interfaces"}),
    "msg": frozenset(),
}
_FOREIGN_TYPE: Final = re.compile(r"\s*([a-z][a-z0-9_]*)/(?:msg/)?[A-Z]")


@dataclass(frozen=True, slots=True, kw_only=True)
class InterfacePackage:
    """Hold one package: its definition files (relative), and the packages that they name."""

    name: str
    folder: Path
    files: tuple[Path, ...]
    named: frozenset[str]


def read_package(folder: Path) -> InterfacePackage:
    """Read the definitions of the package in a folder, which has the package's name.

    Raises:
        DefinitionsInvalid: the folder holds none.
    """
    files = [file for kind in KINDS for file in sorted(folder.glob(f"{kind}/*.{kind}"))]
    if not files:
        raise DefinitionsInvalid(
            f"{folder}: no interface definitions, expected files such as msg/Name.msg, "
            "srv/Name.srv or action/Name.action"
        )
    named: set[str] = set()
    for file in files:
        named |= _IMPLICIT[file.parent.name]
        for line in file.read_text(encoding="utf-8").splitlines():
            if found := _FOREIGN_TYPE.match(line):
                named.add(found.group(1))
    return InterfacePackage(
        name=folder.name,
        folder=folder,
        files=tuple(file.relative_to(folder) for file in files),
        named=frozenset(named - {folder.name}),
    )


def in_build_order(packages: Iterable[InterfacePackage]) -> list[InterfacePackage]:
    """Order packages so that each comes after those of them that it names.

    Raises:
        DefinitionsInvalid: two of them have one name, or they need each other in a circle.
    """
    waiting = {package.name: package for package in packages}
    ordered: list[InterfacePackage] = []
    while waiting:
        free = sorted(name for name, package in waiting.items() if not package.named & set(waiting))
        if not free:
            raise DefinitionsInvalid(f"these packages need each other: {', '.join(waiting)}")
        ordered += [waiting.pop(name) for name in free]
    return ordered


def needed_packages(package: InterfacePackage, folders: Mapping[str, Path]) -> list[str]:
    """Return every package that the type descriptions of `package` reach, without itself.

    `folders` holds, for each known package, the folder of its `msg/*.json` type descriptions.

    Raises:
        DefinitionsInvalid: a package is named that is not known.
    """
    waiting, reached = sorted(package.named), set[str]()
    while waiting:
        name = waiting.pop()
        if name in reached:
            continue
        reached.add(name)
        folder = folders.get(name)
        if folder is None:
            raise DefinitionsInvalid(
                f"{package.folder}: its definitions name the package {name}, which is neither "
                "installed in this environment nor among those to be built"
            )
        for description in folder.glob("*/*.json"):
            hashes = json.loads(description.read_text(encoding="utf-8"))["type_hashes"]
            waiting += [row["type_name"].partition("/")[0] for row in hashes]
    return sorted(reached - {package.name})
