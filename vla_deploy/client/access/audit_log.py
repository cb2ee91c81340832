"""Record requested changes in bounded files of JSON lines: who, from where, what, outcome."""

import json
import logging
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum
from itertools import islice
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.access.accounts import wall_s
from vla_deploy.client.access.errors import AuditUnusable
from vla_deploy.client.access.private_file import open_private, turn
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.state_dir import access_dir_of

_MOST_LETTERS: Final = 400
_MOST_DETAILS: Final = 12
MOST_BYTES: Final = 2**20
MOST_FILES: Final = 5
AUDIT_FILE: Final = "audit.jsonl"
FOLD_S: Final = 60.0
"""Refusals of one act to one address are recorded once within this time, with their count."""
STOP_FOLD_S: Final = 1.0
_MOST_KINDS: Final = 1024
_MOST_WAITING: Final = 256
_log = logging.getLogger(__name__)


class AuditOutcome(StrEnum):
    """Name how an act ended."""

    DONE = "done"
    REFUSED = "refused"
    FAILED = "failed"


def outcome_of(status: int) -> AuditOutcome:
    """Return the outcome of an act by the HTTP status of its answer."""
    if status < 400:
        return AuditOutcome.DONE
    return AuditOutcome.REFUSED if status < 500 else AuditOutcome.FAILED


@dataclass(frozen=True, slots=True, kw_only=True)
class AuditEntry:
    """Describe one act; `details` never hold a password, a token or a cookie."""

    user: str
    role: str
    way: str
    address: str
    act: str
    outcome: AuditOutcome
    code: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)

    @property
    def kind(self) -> tuple[str, ...]:
        """Return what repeated entries have in common, which are recorded once with their count."""
        return (self.user, self.address, self.act, self.outcome, self.code)

    def document(self, now_s: float, repeated: int = 0) -> dict[str, Any]:
        """Return the entry as JSON; `repeated` entries like it were left out before."""
        document: dict[str, Any] = {
            "time": datetime.fromtimestamp(now_s, UTC).isoformat(timespec="milliseconds"),
            "user": self.user,
            "role": self.role,
            "way": self.way,
            "address": self.address,
            "act": self.act,
            "outcome": str(self.outcome),
        }
        optional = {"code": self.code, "details": _bounded(self.details), "repeated": repeated}
        return document | {name: value for name, value in optional.items() if value}


def _bounded(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return details of bounded length; numbers stay numbers, all else becomes text."""
    kept = [one for one in details.items() if one[1] not in ("", None)][:_MOST_DETAILS]
    return {str(name)[:40]: _short(value) for name, value in kept}


def _short(value: Any) -> Any:
    return value if isinstance(value, bool | int | float) else str(value)[:_MOST_LETTERS]


class AuditFile:
    """Hold the audit log on disk: JSON lines, the newest last; several processes may append."""

    def __init__(
        self, path: Path, most_bytes: int = MOST_BYTES, most_files: int = MOST_FILES
    ) -> None:
        self.path = path
        self._most_bytes = most_bytes
        self._most_files = most_files

    def append(self, document: Mapping[str, Any]) -> None:
        """Append one line by one write.

        Raises:
            OSError: it cannot be written, as on a full disk.
        """
        line = json.dumps(document, separators=(",", ":")).encode() + b"\n"
        with turn(self.path.with_suffix(".lock")):
            if self._size() + len(line) > self._most_bytes:
                self._set_aside()
            handle = open_private(self.path, os.O_WRONLY | os.O_APPEND)
            try:
                os.write(handle, line)
            finally:
                os.close(handle)

    def newest(self, count: int) -> list[dict[str, Any]]:
        """Return the last entries, the newest first.

        Raises:
            AuditUnusable: a file cannot be read.
        """
        try:
            return list(islice(self._backwards(), count))
        except OSError as error:
            raise AuditUnusable(
                f"{error.filename}: {error.strerror}; run as the robot's user, or as root"
            ) from error

    def _backwards(self) -> Iterator[dict[str, Any]]:
        for path in self._files():
            if not path.exists():
                continue
            for line in reversed(path.read_bytes().splitlines()):
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # cut off by a full disk
                if isinstance(entry, dict):
                    yield entry

    def _files(self) -> list[Path]:
        older = [Path(f"{self.path}.{number}") for number in range(1, self._most_files)]
        return [self.path, *older]

    def _size(self) -> int:
        return self.path.stat().st_size if self.path.exists() else 0

    def _set_aside(self) -> None:
        files = self._files()
        for older, newer in zip(reversed(files[1:]), reversed(files[:-1]), strict=True):
            if newer.exists():
                newer.replace(older)


class AuditLog:
    """Record acts without waiting for the disk; entries that a full disk loses are counted."""

    def __init__(
        self,
        file: AuditFile,
        clock: Clock,
        executor: Executor | None = None,
        now_s: Callable[[], float] = wall_s,
    ) -> None:
        self._file = file
        self._clock = clock
        self._executor = executor or InlineExecutor()
        self._now_s = now_s
        self._lock = threading.Lock()
        self._folded: OrderedDict[tuple[str, ...], tuple[int, int]] = OrderedDict()
        self._waiting = 0
        self._lost = 0

    @classmethod
    def of_base(cls, base: Path, clock: Clock, executor: Executor | None = None) -> "AuditLog":
        """Return the audit log of the robot that runs in a runtime directory."""
        return cls(AuditFile(access_dir_of(base) / AUDIT_FILE), clock, executor)

    def record(self, entry: AuditEntry, fold_s: float = 0.0) -> None:
        """Write one entry, or count it where one like it was written within `fold_s`."""
        fold_s = FOLD_S if entry.outcome is AuditOutcome.REFUSED else fold_s
        with self._lock:
            repeated = self._fold(entry, fold_s) if fold_s else 0
            if repeated is None:
                return
            if self._waiting >= _MOST_WAITING:
                self._lost += 1
                return
            self._waiting += 1
        document = entry.document(self._now_s(), repeated)
        self._executor.submit(self._write, document)

    def newest(self, count: int) -> list[dict[str, Any]]:
        """Return the last entries, the newest first.

        Raises:
            AuditUnusable: they cannot be read.
        """
        return self._file.newest(count)

    def close(self) -> None:
        """Write the entries that wait."""
        self._executor.shutdown()

    def _fold(self, entry: AuditEntry, fold_s: float) -> int | None:
        """Return how many like it were left out before, None to leave this one out."""
        now_ns = self._clock.now_ns()
        recorded_ns, left_out = self._folded.pop(entry.kind, (0, 0))
        is_first = not recorded_ns or now_ns - recorded_ns > fold_s * NS_PER_S
        self._folded[entry.kind] = (now_ns, 0) if is_first else (recorded_ns, left_out + 1)
        while len(self._folded) > _MOST_KINDS:
            self._folded.popitem(last=False)
        return left_out if is_first else None

    def _write(self, document: dict[str, Any]) -> None:
        with self._lock:
            lost, self._lost = self._lost, 0
        try:
            self._file.append({**document, "lost": lost} if lost else document)
        except OSError as error:
            _log.error("an act is missing in the audit log: %s: %s", document["act"], error)
            with self._lock:
                self._lost += lost + 1
        finally:
            with self._lock:
                self._waiting -= 1
