"""Read how much room the file systems below given folders have."""

import os
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from platforms.probes.reading import Reading, measure
from platforms.tree import Tree, ValueMissing


class DiskSource:
    """Read each folder; the reading without a folder in its name is the tightest of them."""

    def __init__(self, tree: Tree, folders: Sequence[Path]) -> None:
        self._paths = {str(folder): tree.root / str(folder).lstrip("/") for folder in folders}

    def readings(self) -> Iterator[Reading]:
        """Return free bytes and the free part, for programs without special rights."""
        for name, unit, take in (
            ("disk_free_bytes", "bytes", _free_bytes),
            ("disk_free_ratio", "ratio", _free_ratio),
        ):
            each = [
                measure(f"{name}.{folder}", unit, partial(take, path))
                for folder, path in self._paths.items()
            ]
            yield measure(name, unit, partial(_least, each))
            yield from each


def _least(each: Sequence[Reading]) -> float:
    for reading in each:
        if reading.value is None:
            raise ValueMissing(reading.reason.removeprefix("missing, because "))
    if not each:
        raise ValueMissing("no folder was named")
    return min(reading.value for reading in each if reading.value is not None)


def _free_bytes(path: Path) -> float:
    found = _statistics(path)
    return float(found.f_bavail * found.f_frsize)


def _free_ratio(path: Path) -> float:
    found = _statistics(path)
    if not found.f_blocks:
        raise ValueMissing(f"the file system of {path} has no size")
    return found.f_bavail / found.f_blocks


def _statistics(path: Path) -> os.statvfs_result:
    try:
        return os.statvfs(path)
    except OSError as error:
        raise ValueMissing(f"{path}: {error.strerror}") from error
