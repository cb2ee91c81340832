"""Keep numbered files in a bounded folder; an unfinished one never has its final name."""

import logging
import os
import re
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import ClassVar

from drivers.clock import NS_PER_S
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.telemetry.errors import FlightMissing

_log = logging.getLogger(__name__)
_ROOT_BASE = Path("/run/vla-deploy")
_ROOT_FLIGHTS = Path("/var/lib/vla-deploy/flights")
_NAME = re.compile(r"(\d{6,})-.+\.mcap")


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderBounds:
    """Bound a folder; `spare_bytes` of the disk are never used."""

    files: int = 40
    total_bytes: int = 512 * 2**20
    spare_bytes: int = 128 * 2**20


def folder_of(base: Path) -> Path:
    """Return where the runs of a runtime directory leave their flights."""
    return _ROOT_FLIGHTS if base == _ROOT_BASE else state_dir_of(base) / "flights"


class NumberedFolder:
    """Number, bound and list the MCAP files of one folder, each a `noun`."""

    noun: ClassVar[str]
    verb: ClassVar[str]
    """The command that lists them."""

    def __init__(self, path: Path, bounds: FolderBounds | None = None) -> None:
        self.path = path
        self._bounds = bounds or FolderBounds()

    def files(self) -> list[Path]:
        """Return every whole file, the oldest first."""
        if not self.path.is_dir():
            return []
        return sorted(
            (path for path in self.path.iterdir() if _NAME.fullmatch(path.name)), key=_number
        )

    def find(self, name: str) -> Path:
        """Return a file by its path, name or number, or the `latest`.

        Raises:
            FlightMissing: there is none.
        """
        if Path(name).is_file():
            return Path(name)
        files = self.files()
        if name == "latest" and files:
            return files[-1]
        for path in files:
            if path.name == name or (name.isdigit() and _number(path) == int(name)):
                return path
        known = ", ".join(path.name for path in files[-3:]) or "none yet"
        raise FlightMissing(
            f"no {self.noun} {name!r} in {self.path}; the newest there: {known}; see: "
            f"vla-deploy {self.verb} list"
        )

    def unfinished(self, label: str) -> Path:
        """Make room for one more file and return where to write it.

        Raises:
            OSError: the folder cannot be made, or the disk is full without any file in it.
        """
        self.path.mkdir(mode=0o750, parents=True, exist_ok=True)
        self.sweep()
        self.prune(files=self._bounds.files - 1)
        number = max(map(_number, self.files()), default=0) + 1
        return self.path / f".{number:06d}-{label}.mcap.part"

    def publish(self, part: Path) -> Path:
        """Give a finished file its final name.

        Raises:
            OSError: the disk refuses it.
        """
        final = part.with_name(final_name(part))
        part.rename(final)
        directory = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)
        self.prune(files=self._bounds.files)
        return final

    def sweep(self) -> None:
        """Delete the unfinished files of a killed process."""
        for part in self.unfinished_files():
            part.unlink(missing_ok=True)

    def unfinished_files(self) -> list[Path]:
        """Return the files that are being written, or that a killed process was writing."""
        return sorted(self.path.glob(".*.mcap.part"))

    def prune(self, files: int) -> None:
        """Delete the oldest files until the bounds hold; the newest one always stays."""
        kept = self.files()
        while len(kept) > 1 and self._is_over(kept, files):
            oldest = kept.pop(0)
            oldest.unlink(missing_ok=True)
            _log.info("deleted %s %s to keep the folder's bounds", self.noun, oldest.name)

    def is_disk_full(self) -> bool:
        """Return whether less of the disk is free than is to be spared."""
        return shutil.disk_usage(self.path).free < self._bounds.spare_bytes

    def prune_for(self, coming_bytes: int) -> None:
        """Delete the oldest files while another one, of `coming_bytes`, is being written."""
        kept = self.files()
        while kept and self._is_over(kept, self._bounds.files - 1, coming_bytes):
            kept.pop(0).unlink(missing_ok=True)

    def _is_over(self, kept: list[Path], files: int, coming_bytes: int = 0) -> bool:
        total_bytes = coming_bytes + sum(path.stat().st_size for path in kept)
        return len(kept) > files or total_bytes > self._bounds.total_bytes or self.is_disk_full()


class FlightFolder(NumberedFolder):
    """Keep the flights of one folder."""

    noun = "flight"
    verb = "flight"


def dated(wall_ns: int, label: str) -> str:
    """Return the label of a file that begins at a time."""
    return f"{datetime.fromtimestamp(wall_ns / NS_PER_S, UTC):%Y%m%dT%H%M%SZ}-{label}"


def final_name(part: Path) -> str:
    """Return the name of a file that is being written, once it is finished."""
    return part.name.removeprefix(".").removesuffix(".part")


def _number(path: Path) -> int:
    return int(path.name.split("-", 1)[0])
