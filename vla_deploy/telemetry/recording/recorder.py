"""Follow requests and settings: begin a rolling recording, feed it, end it, tell how it goes."""

import logging
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor, Future
from concurrent.futures import TimeoutError as NotInTime
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.one_line import one_line
from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.following import Value
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.feed import Feed
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import START, STOP, RecordingWish, wish_of
from vla_deploy.telemetry.recording.tape import Tape

CLOSE_TIMEOUT_S: Final = 6.0
_STATUS_EVERY_NS: Final = NS_PER_S // 2
_OFF: Final = "off"
_SHOWN_LETTERS: Final = 300
_log = logging.getLogger(__name__)


class RollingRecorder:
    """Own at most one recording; `executor` is the thread that writes it."""

    def __init__(
        self,
        space: SharedSpace,
        clock: Clock,
        *,
        new_tape: Callable[[RecordingWish], Tape],
        new_collector: Callable[[RecordingWish], Collector],
        executor: Executor,
        always: RecordingWish | None = None,
    ) -> None:
        self._space = space
        self._clock = clock
        self._new_tape = new_tape
        self._new_collector = new_collector
        self._executor = executor
        self._always = always
        self._feed: Feed | None = None
        self._wish = RecordingWish()
        self._ends_ns: int | None = None
        self._refused = ""
        self._last: dict[str, Any] = {}
        self._status_due_ns = 0
        self._acts: Mapping[Any, Callable[[Mapping[str, Any]], None]] = {
            START: self._on_start,
            STOP: self._on_stop,
        }

    def start(self) -> None:
        """Open the topics; what settings ask for is recorded from now on."""
        self._requests = self._space.ring_reader("recording_request", from_start=False)
        self._status = self._space.cell_writer("recording_status")
        self._begin(self._always)

    def step(self, now_ns: int, new: Iterable[Value], newest: Callable[[], list[Value]]) -> None:
        """Heed requests, then hand on what is new; a fresh recording begins with the `newest`."""
        for event in self._requests.drain():
            self._heed(event.payload)
        if self._ends_ns is not None and now_ns >= self._ends_ns:
            self._end()
            self._begin(self._always)
        if self._feed is not None:
            self._feed.hand_on(now_ns, _joined(newest(), new) if self._feed.is_fresh else new)
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_EVERY_NS
            self._status.put_document(self.document(now_ns))

    def stop(self) -> None:
        """Finish what is being written, unless the disk takes too long for that.

        What waits is dropped: there is time for a whole file or for the last values, not for both.
        """
        if self._feed is not None:
            self._feed.give_up_backlog()
        closing = self._end()
        try:
            if closing is not None:
                closing.result(timeout=CLOSE_TIMEOUT_S)
        except NotInTime:
            _log.warning("the disk is too slow to finish the recording; the next run recovers it")
        self._executor.shutdown(wait=False, cancel_futures=True)

    def document(self, now_ns: int) -> dict[str, Any]:
        """Return what `recording_status` tells."""
        if self._feed is None:
            return {"state": _OFF, "refused": self._refused, "last": self._last}
        left_s = None if self._ends_ns is None else max(0.0, (self._ends_ns - now_ns) / NS_PER_S)
        return {
            **self._feed.document(),
            "label": self._wish.label,
            "source": self._wish.source,
            "topics": ", ".join(self._wish.topics)[:_SHOWN_LETTERS],
            "without": ", ".join(self._wish.without)[:_SHOWN_LETTERS],
            "left_s": left_s,
            "refused": self._refused,
            "last": self._last,
        }

    def _heed(self, request: Mapping[str, Any]) -> None:
        act = self._acts.get(request.get("act"))
        if act is None:
            self._refuse(f"act: expected start or stop, got {request.get('act')!r:.40}")
        else:
            act(request)

    def _on_start(self, request: Mapping[str, Any]) -> None:
        try:
            wish = wish_of(request)
            wish.selection.among(channel.topic for channel in ALL_CHANNELS)
        except RecordingRefused as refusal:
            self._refuse(one_line(refusal))
            return
        self._end()
        self._begin(wish)

    def _on_stop(self, request: Mapping[str, Any]) -> None:
        if self._end() is not None:
            _log.info("recording ended by %s", request.get("source", ""))

    def _refuse(self, reason: str) -> None:
        self._refused = reason[:_SHOWN_LETTERS]
        _log.warning("no recording: %s", reason)

    def _begin(self, wish: RecordingWish | None) -> None:
        self._ends_ns = None
        if wish is None:
            return
        self._refused, self._wish = "", wish
        self._feed = Feed(self._new_tape(wish), self._new_collector(wish), self._executor)
        if wish.duration_s is not None:
            self._ends_ns = self._clock.now_ns() + round(wish.duration_s * NS_PER_S)
        _log.info("recording %s for %s", ", ".join(wish.topics), wish.source or "nobody named")

    def _end(self) -> "Future[None] | None":
        feed, self._feed = self._feed, None
        self._ends_ns = None
        if feed is None:
            return None
        self._last = feed.document()
        return feed.close()


def _joined(newest: list[Value], new: Iterable[Value]) -> list[Value]:
    return [*newest, *(value for value in new if value not in newest)]
