"""Remember which files were written, so that exactly those are removed again."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

from vla_deploy.install.changes import Change, Kind, Known, digest
from vla_deploy.install.disk import write_file
from vla_deploy.install.errors import InstallError
from vla_deploy.install.layout import Layout

_OURS = (Kind.SAME, Kind.WRITE, Kind.UPDATE, Kind.BESIDE)


def read_manifest(layout: Layout) -> dict[Path, frozenset[str]]:
    """Return the digests of what was written, by path; nothing when nothing is installed.

    Raises:
        InstallError: the manifest is damaged.
    """
    file = layout.on_disk(layout.manifest)
    if not file.is_file():
        return {}
    try:
        listed = json.loads(file.read_text())["files"]
        return {Path(path): frozenset(digests) for path, digests in listed.items()}
    except (json.JSONDecodeError, KeyError, AttributeError, TypeError) as error:
        raise InstallError(
            f"manifest {file} is damaged ({error}); move it away and install again: files that "
            "are there already will be kept, with the new version beside them"
        ) from error


def write_manifest(layout: Layout, known: Mapping[Path, Iterable[str]]) -> None:
    """Write the manifest, or remove it when nothing is left to remember."""
    file = layout.on_disk(layout.manifest)
    if not known:
        file.unlink(missing_ok=True)
        return
    listed = {str(path): sorted(digests) for path, digests in known.items()}
    write_file(file, json.dumps({"files": listed}, indent=1) + "\n", 0o644)


def during(known: Known, changes: Iterable[Change]) -> dict[Path, frozenset[str]]:
    """Return what is ours while the changes go on: the old versions and the new ones."""
    return {
        path: known.get(path, frozenset()) | digests
        for path, digests in {**dict(known), **afterwards(known, changes)}.items()
    }


def afterwards(known: Known, changes: Iterable[Change]) -> dict[Path, frozenset[str]]:
    """Return what is ours once every change is made; a kept file that was edited still is."""
    ours = {
        change.path: frozenset({digest(change.after)})
        for change in changes
        if change.kind in _OURS and change.after is not None
    }
    edited = {
        change.path: known[change.path]
        for change in changes
        if change.kind is Kind.KEEP and change.path in known
    }
    return {**edited, **ours}
