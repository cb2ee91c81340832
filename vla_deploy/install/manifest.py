"""Remember which files were written, so that exactly those are removed again."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from vla_deploy.install.changes import ChangeKind, FileChange, Known, digest
from vla_deploy.install.disk import write_file
from vla_deploy.install.errors import InstallError
from vla_deploy.install.files import ServiceChoice
from vla_deploy.install.layout import InstallLayout

_OURS = (ChangeKind.SAME, ChangeKind.WRITE, ChangeKind.UPDATE, ChangeKind.BESIDE)


def read_manifest(layout: InstallLayout) -> dict[Path, frozenset[str]]:
    """Return the digests of what was written, by path; nothing when nothing is installed.

    Raises:
        InstallError: the manifest is damaged.
    """
    listed = _document(layout).get("files", {})
    return {Path(path): frozenset(digests) for path, digests in listed.items()}


def installed_choice(layout: InstallLayout) -> ServiceChoice:
    """Return what the installed service runs; what it would run when nothing is installed.

    Raises:
        InstallError: the manifest is damaged.
    """
    service = _document(layout).get("service", {})
    return ServiceChoice(robot=service.get("robot", "butler"), profile=service.get("profile", ""))


def write_manifest(
    layout: InstallLayout,
    known: Mapping[Path, Iterable[str]],
    choice: ServiceChoice | None = None,
) -> None:
    """Write the manifest, or remove it when nothing is left to remember."""
    file = layout.on_disk(layout.manifest)
    if not known:
        file.unlink(missing_ok=True)
        return
    listed = {str(path): sorted(digests) for path, digests in known.items()}
    service = {"robot": choice.robot, "profile": choice.profile} if choice else {}
    text = json.dumps({"files": listed, "service": service}, indent=1)
    write_file(file, f"{text}\n", 0o644)


def _document(layout: InstallLayout) -> dict[str, Any]:
    file = layout.on_disk(layout.manifest)
    if not file.is_file():
        return {}
    try:
        document = json.loads(file.read_text())
    except json.JSONDecodeError as error:
        raise _damaged(file, str(error)) from error
    tables = ("files", "service")
    if not isinstance(document, dict) or not all(
        isinstance(document.get(name), dict) for name in tables
    ):
        raise _damaged(file, f"expected the tables {' and '.join(tables)}")
    return document


def _damaged(file: Path, what: str) -> InstallError:
    return InstallError(
        f"manifest {file} is damaged ({what}); move it away and install again: files that "
        "are there already will be kept, with the new version beside them"
    )


def during(known: Known, changes: Iterable[FileChange]) -> dict[Path, frozenset[str]]:
    """Return what is ours while the changes go on: the old versions and the new ones."""
    return {
        path: known.get(path, frozenset()) | digests
        for path, digests in {**dict(known), **afterwards(known, changes)}.items()
    }


def afterwards(known: Known, changes: Iterable[FileChange]) -> dict[Path, frozenset[str]]:
    """Return what is ours once every change is made; a kept file that was edited still is."""
    ours = {
        change.path: frozenset({digest(change.after)})
        for change in changes
        if change.kind in _OURS and change.after is not None
    }
    edited = {
        change.path: known[change.path]
        for change in changes
        if change.kind is ChangeKind.KEEP and change.path in known
    }
    return {**edited, **ours}
