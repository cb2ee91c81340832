"""Make rolling recordings, as `recording.toml` and requests ask for them, and report on them."""

import logging
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, Future
from concurrent.futures import TimeoutError as NotInTime
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.recording import NoRecording, RecordingProgress, RecordingStatus
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.one_line import one_line
from vla_deploy.telemetry.channels import ChannelValue
from vla_deploy.telemetry.errors import RecordingRefused, RecordingSettingsInvalid
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.messages import Collector
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import START, STOP, RecordingRequest, parse_request
from vla_deploy.telemetry.recording.rolling_writer import RollingWriter
from vla_deploy.telemetry.recording.settings import RecordingSettings, read_settings

BACKLOG_BYTES: Final = 24 * 2**20
CLOSE_TIMEOUT_S: Final = 6.0
WRITING_S: Final = 0.02
"""Simulated time to write a step's batch: less than the period of the steps."""
_STATUS_PERIOD_NS: Final = NS_PER_S // 2
_OFF: Final = "off"
_MAX_TEXT: Final = 300
_log = logging.getLogger(__name__)


class RollingRecorder:
    """Make at most one recording at a time; a low-priority thread writes it.

    Settings with faults are logged and replaced by the defaults: flights matter more.
    """

    def __init__(
        self,
        context: NodeContext,
        space: SharedSpace,
        wall_ns: Callable[[], int],
        *,
        settings: RecordingSettings | None = None,
        folder: RecordingFolder | None = None,
        executor: Executor | None = None,
    ) -> None:
        base = context.run_dir.parent
        self._context = context
        self._space = space
        self._clock = context.clock
        self._wall_ns = wall_ns
        self._settings = settings or _settings(context)
        self._folder = folder or RecordingFolder(recordings_dir_of(base), self._settings.bounds)
        self._executor = executor or low_priority_thread(context.clock, WRITING_S)
        self._always = self._settings.request if self._settings.always else None
        self._queue: WriteQueue | None = None
        self._request = RecordingRequest()
        self._ends_ns: int | None = None
        self._refused = ""
        self._last: RecordingProgress | NoRecording = {}
        self._status_due_ns = 0
        self._acts: Mapping[Any, Callable[[Mapping[str, Any]], None]] = {
            START: self._on_start,
            STOP: self._on_stop,
        }

    def start(self) -> None:
        """Open the topics, and begin the recording that the settings ask for."""
        self._requests = self._space.ring_reader(topics.RECORDING_REQUEST, from_start=False)
        self._status = self._space.cell_writer(topics.RECORDING_STATUS)
        self._begin(self._always)

    def step(
        self,
        now_ns: int,
        new: Iterable[ChannelValue],
        newest: Callable[[], list[ChannelValue]],
    ) -> None:
        """Follow requests, then pass on what is new; a recording begins with the `newest`."""
        for event in self._requests.drain():
            self._follow(event.payload)
        if self._ends_ns is not None and now_ns >= self._ends_ns:
            self._end()
            self._begin(self._always)
        if self._queue is not None:
            values = _joined(newest(), new) if self._queue.is_fresh else new
            self._queue.submit(now_ns, values)
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_PERIOD_NS
            self._status.put_document(self.document(now_ns))

    def stop(self) -> None:
        """Finish the file, unless the disk takes too long for that.

        The backlog is dropped: there is time to finish the file or to write the last values.
        """
        if self._queue is not None:
            self._queue.drop_backlog()
        closing = self._end()
        try:
            if closing is not None:
                closing.result(timeout=CLOSE_TIMEOUT_S)
        except NotInTime:
            _log.warning("the disk is too slow to finish the recording; the next run recovers it")
        self._executor.shutdown(wait=False, cancel_futures=True)

    def document(self, now_ns: int) -> RecordingStatus:
        """Return the document of `recording_status`."""
        if self._queue is None:
            return {"state": _OFF, "refused": self._refused, "last": self._last}
        left_s = None if self._ends_ns is None else max(0.0, (self._ends_ns - now_ns) / NS_PER_S)
        return {
            **self._queue.document(),
            "label": self._request.label,
            "source": self._request.source,
            "topics": ", ".join(self._request.topics)[:_MAX_TEXT],
            "without": ", ".join(self._request.without)[:_MAX_TEXT],
            "left_s": left_s,
            "refused": self._refused,
            "last": self._last,
        }

    def _follow(self, request: Mapping[str, Any]) -> None:
        act = self._acts.get(request.get("act"))
        if act is None:
            self._refuse(f"act: expected start or stop, got {request.get('act')!r:.40}")
        else:
            act(request)

    def _on_start(self, document: Mapping[str, Any]) -> None:
        try:
            request = parse_request(document)
            request.selection.among(channel.topic for channel in ALL_CHANNELS)
        except RecordingRefused as refusal:
            self._refuse(one_line(refusal))
            return
        self._end()
        self._begin(request)

    def _on_stop(self, request: Mapping[str, Any]) -> None:
        if self._end() is not None:
            _log.info("recording ended by %s", request.get("source", ""))

    def _refuse(self, reason: str) -> None:
        self._refused = reason[:_MAX_TEXT]
        _log.warning("no recording: %s", reason)

    def _begin(self, request: RecordingRequest | None) -> None:
        self._ends_ns = None
        if request is None:
            return
        self._refused, self._request = "", request
        context, settings = self._context, self._settings
        collector = Collector(
            self._space, context.run_dir, request.selection, settings.image_period_s
        )
        writer = RollingWriter(context, self._folder, request, settings, self._wall_ns)
        self._queue = WriteQueue(writer, collector, self._executor)
        if request.duration_s is not None:
            self._ends_ns = self._clock.now_ns() + round(request.duration_s * NS_PER_S)
        by = request.source or "nobody named"
        _log.info("recording %s for %s", ", ".join(request.topics), by)

    def _end(self) -> "Future[None] | None":
        queue, self._queue = self._queue, None
        self._ends_ns = None
        if queue is None:
            return None
        self._last = queue.document()
        return queue.close()


class WriteQueue:
    """Pass batches of one recording to the writer's thread, so that a slow disk delays no step.

    Batches beyond a bounded backlog are dropped and counted.
    """

    def __init__(self, writer: RollingWriter, collector: Collector, executor: Executor) -> None:
        self.is_fresh = True
        self._writer = writer
        self._collector = collector
        self._executor = executor
        self._backlog: deque[tuple[Future[None], int]] = deque()
        self._dropped = 0

    def submit(self, now_ns: int, values: Iterable[ChannelValue]) -> None:
        """Collect what is new and have it written.

        Raises:
            Exception: an earlier batch failed, by something else than the disk.
        """
        self.is_fresh = False
        while self._backlog and self._backlog[0][0].done():
            self._backlog.popleft()[0].result()
        batch = self._collector.batch(now_ns, values)
        if not batch.count:
            return
        if self.backlog_bytes + batch.size_bytes > BACKLOG_BYTES:
            self._dropped += batch.count
            return
        self._backlog.append((self._executor.submit(self._writer.write, batch), batch.size_bytes))

    def drop_backlog(self) -> None:
        """Drop what waits to be written."""
        for future, _ in self._backlog:
            future.cancel()

    def close(self) -> "Future[None]":
        """Have the file finished, after what still waits is written."""
        return self._executor.submit(self._writer.close)

    @property
    def backlog_bytes(self) -> int:
        """Return how much waits to be written."""
        return sum(size_bytes for _, size_bytes in self._backlog)

    def document(self) -> RecordingProgress:
        """Return the state of the recording; `lost` counts values that are in no file."""
        report = self._writer.report
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


def _settings(context: NodeContext) -> RecordingSettings:
    try:
        return read_settings(context.run_dir.parent).recording
    except RecordingSettingsInvalid as error:
        _log.error("degraded: recording goes by its defaults: %s", error)
        return RecordingSettings()


def _joined(newest: list[ChannelValue], new: Iterable[ChannelValue]) -> list[ChannelValue]:
    return [*newest, *(value for value in new if value not in newest)]
