"""Write down every act, beside the requests; floods of the same one become a line and a number."""

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.dashboard.access.accounts import wall_s
from vla_deploy.dashboard.access.audit_entry import AuditEntry, Outcome
from vla_deploy.dashboard.access.audit_file import AuditFile
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.state_dir import access_dir_of

FILE_NAME: Final = "audit.jsonl"
FOLD_S: Final = 60.0
"""Refusals of the same act to the same address are told once in this time, with their number."""
STOP_FOLD_S: Final = 1.0
_MOST_KINDS: Final = 1024
_MOST_WAITING: Final = 256
_log = logging.getLogger(__name__)


class AuditLog:
    """Tell who did what; a full or slow disk holds nobody up, and what it cost is counted."""

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
        return cls(AuditFile(access_dir_of(base) / FILE_NAME), clock, executor)

    def tell(self, entry: AuditEntry, fold_s: float = 0.0) -> None:
        """Write one entry, or count it where one like it was written less than `fold_s` ago."""
        fold_s = FOLD_S if entry.outcome is Outcome.REFUSED else fold_s
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
        """Write what waits."""
        self._executor.shutdown()

    def _fold(self, entry: AuditEntry, fold_s: float) -> int | None:
        """Return how many like it were left out before, None where this one is left out."""
        now_ns = self._clock.now_ns()
        told_ns, left_out = self._folded.pop(entry.kind, (0, 0))
        is_first = not told_ns or now_ns - told_ns > fold_s * NS_PER_S
        self._folded[entry.kind] = (now_ns, 0) if is_first else (told_ns, left_out + 1)
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
