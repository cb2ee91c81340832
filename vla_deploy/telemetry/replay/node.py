"""Replay one file into a run directory; follow requests to pause, seek and change the speed."""

import logging
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.recording import ReplayStatus
from vla_deploy.ipc.replay_mark import mark_replay
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.one_line import one_line
from vla_deploy.telemetry.channels import channels_of
from vla_deploy.telemetry.errors import ReplayRefused
from vla_deploy.telemetry.recorded_file import RecordedFile, RecordedMessage
from vla_deploy.telemetry.replay.feeder import LASTING, TopicFeeder, fed_topics

_STATUS_EVERY_NS: Final = NS_PER_S // 4
_AT_ONCE: Final = 4000
SLOWEST: Final = 0.05
FASTEST: Final = 50.0
_log = logging.getLogger(__name__)


class PlaybackPosition:
    """Move from `began_ns` to `ended_ns` of a file at a variable speed; pure, `now_ns` is given."""

    def __init__(self, began_ns: int, ended_ns: int, now_ns: int) -> None:
        self.began_ns = began_ns
        self.ended_ns = ended_ns
        self.speed = 1.0
        self.is_paused = False
        self._from_ns = began_ns
        self._since_ns = now_ns

    def position_ns(self, now_ns: int) -> int:
        """Return the present moment of the file."""
        if self.is_paused:
            return self._from_ns
        elapsed_ns = round((now_ns - self._since_ns) * self.speed)
        return min(self._from_ns + elapsed_ns, self.ended_ns)

    def pause(self, now_ns: int, *, paused: bool) -> None:
        """Pause, or go on."""
        self._anchor(now_ns)
        self.is_paused = paused

    def set_speed(self, now_ns: int, speed: float) -> None:
        """Change the speed; 1 is that of the recording.

        Raises:
            ReplayRefused: that is too slow or too fast.
        """
        if not SLOWEST <= speed <= FASTEST:
            raise ReplayRefused(f"speed: expected {SLOWEST} to {FASTEST}, got {speed}")
        self._anchor(now_ns)
        self.speed = speed

    def seek(self, now_ns: int, at_s: float) -> int:
        """Go on from `at_s` after the beginning, and return that moment.

        Raises:
            ReplayRefused: that is beyond the file.
        """
        length_s = (self.ended_ns - self.began_ns) / NS_PER_S
        if not 0.0 <= at_s <= length_s:
            raise ReplayRefused(f"seek: expected 0 to {length_s:.1f} s, got {at_s}")
        self._from_ns, self._since_ns = self.began_ns + round(at_s * NS_PER_S), now_ns
        return self._from_ns

    def _anchor(self, now_ns: int) -> None:
        self._from_ns, self._since_ns = self.position_ns(now_ns), now_ns


class ReplayNode:
    """Feed the topics at the speed of the file; a seek looks up the value before of each topic."""

    period_s = 0.02

    def __init__(
        self, run_dir: Path, file: RecordedFile, clock: Clock, *, loop: bool = False
    ) -> None:
        """Mark the run as a replay, before any other process opens it.

        Raises:
            SpaceUnavailable: its shared memory cannot be opened.
        """
        ipc = run_dir / "ipc"
        mark_replay(ipc, file.path.name)
        self.playback = PlaybackPosition(file.complete_from_ns, file.ended_ns, clock.now_ns())
        self._clock = clock
        self._file = file
        self._loop = loop
        self._space = SharedSpace(ipc, clock, is_replay=True)
        self._feeder = TopicFeeder(self._space, run_dir / LOGS_DIR, clock)
        self._coming: Iterator[RecordedMessage] = iter(())
        self._next: RecordedMessage | None = None
        self._refused = ""
        self._status_due_ns = 0
        self._acts: Mapping[Any, Callable[[int, float], object]] = {
            "pause": lambda now_ns, _: self.playback.pause(now_ns, paused=True),
            "resume": lambda now_ns, _: self.playback.pause(now_ns, paused=False),
            "speed": self.playback.set_speed,
            "seek": self.seek,
        }

    def start(self) -> None:
        """Open the topics, and write the values of the replay's beginning."""
        self._requests = self._space.ring_reader(topics.REPLAY_REQUEST, from_start=False)
        self._status = self._space.cell_writer(topics.REPLAY_STATUS)
        self._show_from(self.playback.position_ns(self._clock.now_ns()))

    def step(self) -> None:
        """Feed what is due by now."""
        now_ns = self._clock.now_ns()
        for event in self._requests.drain():
            self._follow(now_ns, event.payload)
        position_ns = self.playback.position_ns(now_ns)
        for _ in range(_AT_ONCE):
            if self._next is None or self._next.at_ns > position_ns:
                break
            self._feeder.feed(self._next)
            self._next = next(self._coming, None)
        if self._next is None and self._loop and not self.playback.is_paused:
            self.seek(now_ns, 0.0)
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_EVERY_NS
            self._status.put_document(self.document(now_ns))
            if self.playback.is_paused or self._next is None:
                self._feeder.hold(position_ns)

    def stop(self) -> None:
        """Close the topics."""
        self._space.close()

    def seek(self, now_ns: int, at_s: float) -> None:
        """Go on from another moment, `at_s` after the beginning.

        Raises:
            ReplayRefused: that is beyond the file.
        """
        self._show_from(self.playback.seek(now_ns, at_s))

    def document(self, now_ns: int) -> ReplayStatus:
        """Return the document of `replay_status`."""
        playback, file = self.playback, self._file
        return {
            "file": file.path.name,
            "kind": file.kind,
            "robot": file.robot,
            "run_id": file.run_id,
            "state": (
                "paused" if playback.is_paused else "ended" if self._next is None else "playing"
            ),
            "position_s": round((playback.position_ns(now_ns) - playback.began_ns) / NS_PER_S, 3),
            "duration_s": round((playback.ended_ns - playback.began_ns) / NS_PER_S, 3),
            "began_s": round(playback.began_ns / NS_PER_S, 3),
            "speed": playback.speed,
            "loop": self._loop,
            "unfit": self._feeder.unfit,
            "refused": self._refused,
        }

    def _show_from(self, at_ns: int) -> None:
        lasting = [
            channel.topic
            for topic in fed_topics()
            if topic.kind in LASTING
            for channel in channels_of(topic)
        ]
        for message in self._file.last_before(at_ns, lasting):
            self._feeder.feed(message)
        self._coming = self._file.messages_from(at_ns)
        self._next = next(self._coming, None)

    def _follow(self, now_ns: int, request: Mapping[str, Any]) -> None:
        act, value = self._acts.get(request.get("act")), request.get("value", 0.0)
        try:
            if act is None or type(value) not in (int, float):
                raise ReplayRefused(f"expected one of {', '.join(self._acts)}, got {request!r:.80}")
            act(now_ns, float(value))
            self._refused = ""
        except ReplayRefused as refusal:
            self._refused = one_line(refusal)
            _log.warning("%s", refusal)
