"""Keep flights in a bounded folder; a half-written one never has a final name."""

import logging
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from vla_deploy.state_dir import state_dir_of
from vla_deploy.telemetry.errors import FlightMissing

_log = logging.getLogger(__name__)
_ROOT_BASE = Path("/run/vla-deploy")
_ROOT_FLIGHTS = Path("/var/lib/vla-deploy/flights")
_NAME = re.compile(r"(\d{6,})-.+\.mcap")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Bound the folder; `spare_bytes` of the disk are never used."""

    files: int = 40
    total_bytes: int = 512 * 2**20
    spare_bytes: int = 128 * 2**20


def folder_of(base: Path) -> Path:
    """Return where the runs of a runtime directory leave their flights."""
    return _ROOT_FLIGHTS if base == _ROOT_BASE else state_dir_of(base) / "flights"


class FlightFolder:
    """Number, bound and list the flights of one folder."""

    def __init__(self, path: Path, bounds: Bounds | None = None) -> None:
        self.path = path
        self._bounds = bounds or Bounds()

    def flights(self) -> list[Path]:
        """Return every whole flight, the oldest first."""
        if not self.path.is_dir():
            return []
        return sorted(
            (path for path in self.path.iterdir() if _NAME.fullmatch(path.name)), key=_number
        )

    def find(self, name: str) -> Path:
        """Return a flight by path, by its number, or the `latest`.

        Raises:
            FlightMissing: there is none.
        """
        if Path(name).is_file():
            return Path(name)
        flights = self.flights()
        if name == "latest" and flights:
            return flights[-1]
        for path in flights:
            if path.name == name or (name.isdigit() and _number(path) == int(name)):
                return path
        known = ", ".join(path.name for path in flights[-3:]) or "none yet"
        raise FlightMissing(
            f"no flight {name!r} in {self.path}; the newest there: {known}; see: "
            "vla-deploy flight list"
        )

    def unfinished(self, label: str) -> Path:
        """Make room for one more flight and return where to write it.

        Raises:
            OSError: the folder cannot be made, or the disk is full without any flight in it.
        """
        self.path.mkdir(mode=0o750, parents=True, exist_ok=True)
        self.sweep()
        self.prune(files=self._bounds.files - 1)
        number = max(map(_number, self.flights()), default=0) + 1
        return self.path / f".{number:06d}-{label}.mcap.part"

    def publish(self, part: Path) -> Path:
        """Give a whole flight its final name, once its bytes are on the disk.

        Raises:
            OSError: the disk refuses it.
        """
        final = part.with_name(part.name.removeprefix(".").removesuffix(".part"))
        part.rename(final)
        directory = os.open(self.path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)
        self.prune(files=self._bounds.files)
        return final

    def sweep(self) -> None:
        """Delete what a killed recorder left half-written."""
        for part in self.path.glob(".*.mcap.part"):
            part.unlink(missing_ok=True)

    def prune(self, files: int) -> None:
        """Delete the oldest flights until the bounds hold; the newest one always stays."""
        flights = self.flights()
        while len(flights) > 1 and self._is_over(flights, files):
            oldest = flights.pop(0)
            oldest.unlink(missing_ok=True)
            _log.info("deleted the oldest flight %s to keep the folder's bounds", oldest.name)

    def _is_over(self, flights: list[Path], files: int) -> bool:
        total_bytes = sum(path.stat().st_size for path in flights)
        full = shutil.disk_usage(self.path).free < self._bounds.spare_bytes
        return len(flights) > files or total_bytes > self._bounds.total_bytes or full


def _number(path: Path) -> int:
    return int(path.name.split("-", 1)[0])
