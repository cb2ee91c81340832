"""Write a rolling recording: a file ends by size or age, and the next one begins.

All of it runs in the writer's thread, so that a slow disk delays nothing else.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.folder import dated, final_name
from vla_deploy.telemetry.recording.folder import RecordingFolder
from vla_deploy.telemetry.recording.messages import DraftMessage, MessageDrafter, TopicBatch
from vla_deploy.telemetry.recording.recording_file import RecordingFile
from vla_deploy.telemetry.recording.request import RecordingRequest
from vla_deploy.telemetry.recording.settings import RecordingSettings

FLUSH_S: Final = 1.0
RETRY_S: Final = 10.0
_FULL: Final = "the disk is as full as it may be; make room on it"
_log = logging.getLogger(__name__)


class RecordingState(Enum):
    """Name the states of a recording."""

    BEGINNING = "beginning"
    RECORDING = "recording"
    PAUSED = "paused"
    FAILED = "failed"
    ENDED = "ended"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingReport:
    """Report on a recording; replaced as a whole, for another thread reads it."""

    state: RecordingState = RecordingState.BEGINNING
    why: str = ""
    file: str = ""
    file_bytes: int = 0
    messages: int = 0
    files: int = 0
    unwritten: int = 0


class RollingWriter:
    """Write the files of one recording; each begins with the lasting values of before."""

    def __init__(
        self,
        context: NodeContext,
        folder: RecordingFolder,
        request: RecordingRequest,
        settings: RecordingSettings,
        wall_ns: Callable[[], int],
    ) -> None:
        self.report = RecordingReport()
        self._folder = folder
        self._context = context
        self._selection = request.selection
        self._label = request.label
        self._file_bytes = round(settings.file_mb * 1e6)
        self._file_s = settings.file_s
        self._clock = context.clock
        self._wall_ns = wall_ns
        self._drafter = MessageDrafter(context.robot, request.selection.takes)
        self._file: RecordingFile | None = None
        self._lasting: dict[str, DraftMessage] = {}
        self._messages = self._files = self._unwritten = 0
        self._flush_ns = self._retry_ns = 0

    def write(self, batch: TopicBatch) -> None:
        """Write a batch; after a failure of the disk, count it and try again some seconds later."""
        try:
            file = self._file or self._next_file()
            if file is None:
                self._unwritten += batch.count
                self._report(self.report.state, self.report.why)
                return
            self._add(file, batch)
            if self._clock.now_ns() >= self._flush_ns:
                self._check(file)
        except OSError as error:
            self._fail(error, batch.count)

    def close(self) -> None:
        """Finish the file."""
        try:
            self._finish()
        except OSError as error:
            self._fail(error, 0)
        self._report(RecordingState.ENDED, self.report.why)

    def _add(self, file: RecordingFile, batch: TopicBatch) -> None:
        before = file.messages
        for message in self._drafter.messages(batch, file.offset_ns):
            if message.stays:
                self._lasting[message.channel] = message
            file.add((message,))
        self._messages += file.messages - before

    def _next_file(self) -> RecordingFile | None:
        """Begin a file, unless it is too soon after a failure, or the disk is too full."""
        now_ns = self._clock.now_ns()
        if now_ns < self._retry_ns:
            return None
        self._retry_ns = now_ns + round(RETRY_S * NS_PER_S)
        offset_ns = self._wall_ns() - now_ns
        part = self._folder.unfinished(dated(now_ns + offset_ns, self._label))
        if self._folder.is_disk_full():
            self._report(RecordingState.PAUSED, _FULL)
            return None
        file = RecordingFile(part, self._context, self._selection, now_ns, offset_ns)
        self._file, self._retry_ns = file, 0
        self._begin(file, now_ns)
        return file

    def _begin(self, file: RecordingFile, now_ns: int) -> None:
        """Write the lasting values of before, and the constant views."""
        file.add(self._lasting.values())
        file.add(self._drafter.constant_views(now_ns, file.offset_ns))
        self._messages += file.messages
        self._files += 1
        self._check(file)

    def _check(self, file: RecordingFile) -> None:
        """Flush the file, and end it if it is large or old, or the disk full."""
        now_ns = self._clock.now_ns()
        self._flush_ns = now_ns + round(FLUSH_S * NS_PER_S)
        size_bytes = file.flush()
        self._report(RecordingState.RECORDING, "", size_bytes)
        is_old = now_ns - file.began_ns >= self._file_s * NS_PER_S
        if is_old or size_bytes >= self._file_bytes:
            self._finish()
            return
        self._folder.prune_for(size_bytes)
        if self._folder.is_disk_full():
            self._finish()
            self._retry_ns = now_ns + round(RETRY_S * NS_PER_S)
            self._report(RecordingState.PAUSED, _FULL)

    def _finish(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.finish()
            _log.info("recorded %s", self._folder.publish(file.path))

    def _fail(self, error: OSError, unwritten: int) -> None:
        if self._file is not None:
            self._file.abandon()
            self._file = None
        self._unwritten += unwritten
        self._retry_ns = self._clock.now_ns() + round(RETRY_S * NS_PER_S)
        reason = f"{self._folder.path}: {error.strerror or error}"
        if self.report.state is not RecordingState.FAILED:
            _log.error("nothing is recorded: %s; tried again every %.0f s", reason, RETRY_S)
        self._report(RecordingState.FAILED, reason)

    def _report(self, state: RecordingState, why: str, size_bytes: int = 0) -> None:
        self.report = RecordingReport(
            state=state,
            why=why,
            file="" if self._file is None else final_name(self._file.path),
            file_bytes=size_bytes,
            messages=self._messages,
            files=self._files,
            unwritten=self._unwritten,
        )
