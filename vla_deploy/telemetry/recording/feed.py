"""Feed one tape from the steps: whatever the disk does, a step hands on or drops, and goes on."""

from collections import deque
from collections.abc import Iterable
from concurrent.futures import Executor, Future
from typing import Any, Final

from vla_deploy.telemetry.following import Value
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.tape import Tape

BACKLOG_BYTES: Final = 24 * 2**20


class Feed:
    """Hand batches to the writer's thread; beyond a bounded backlog they are dropped, counted."""

    def __init__(self, tape: Tape, collector: Collector, executor: Executor) -> None:
        self.is_fresh = True
        self._tape = tape
        self._collector = collector
        self._executor = executor
        self._backlog: deque[tuple[Future[None], int]] = deque()
        self._dropped = 0

    def hand_on(self, now_ns: int, values: Iterable[Value]) -> None:
        """Collect what is new and have it written.

        Raises:
            Exception: whatever went wrong with a batch before, other than the disk.
        """
        self.is_fresh = False
        self._settle()
        batch = self._collector.batch(now_ns, values)
        if not batch.count:
            return
        if self.backlog_bytes + batch.size_bytes > BACKLOG_BYTES:
            self._dropped += batch.count
            return
        self._backlog.append((self._executor.submit(self._tape.write, batch), batch.size_bytes))

    def give_up_backlog(self) -> None:
        """Drop what waits to be written: the file is to be finished now."""
        for future, _ in self._backlog:
            future.cancel()

    def close(self) -> "Future[None]":
        """Have the file finished; what still waits is written first."""
        return self._executor.submit(self._tape.close)

    @property
    def backlog_bytes(self) -> int:
        """Return how much waits to be written."""
        return sum(size_bytes for _, size_bytes in self._backlog)

    def document(self) -> dict[str, Any]:
        """Tell how the recording goes; `lost` counts values that are in no file."""
        report = self._tape.report
        return {
            "state": report.state.value,
            "why": report.why,
            "file": report.file,
            "file_bytes": report.file_bytes,
            "files": report.files,
            "messages": report.messages,
            "lost": self._dropped + report.unwritten,
            "backlog_bytes": self.backlog_bytes,
        }

    def _settle(self) -> None:
        while self._backlog and self._backlog[0][0].done():
            self._backlog.popleft()[0].result()
