"""Replay one file into a run directory, and do what the replay is asked: pause, seek, speed."""

import logging
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace
from vla_deploy.ipc.replay_mark import mark_replay
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.one_line import one_line
from vla_deploy.telemetry.channels import channels_of
from vla_deploy.telemetry.errors import ReplayRefused
from vla_deploy.telemetry.replay.feeder import LASTING, Feeder, fed_topics
from vla_deploy.telemetry.replay.pace import Pace
from vla_deploy.telemetry.replay.source import Recorded, Source

_STATUS_EVERY_NS: Final = NS_PER_S // 4
_AT_ONCE: Final = 4000
_log = logging.getLogger(__name__)


class ReplayNode:
    """Feed the topics at the pace of the file; only the newest of what was missed is looked up."""

    period_s = 0.02

    def __init__(self, run_dir: Path, source: Source, clock: Clock, *, loop: bool = False) -> None:
        """Mark the run as a replay, before anybody else opens it.

        Raises:
            SpaceUnavailable: its shared memory cannot be opened.
        """
        ipc = run_dir / "ipc"
        mark_replay(ipc, source.summary.path.name)
        self.pace = Pace(source.began_ns, source.ended_ns, clock.now_ns())
        self._clock = clock
        self._source = source
        self._loop = loop
        self._space = SharedSpace(ipc, clock, is_replay=True)
        self._feeder = Feeder(self._space, run_dir / LOGS_DIR, clock)
        self._coming: Iterator[Recorded] = iter(())
        self._next: Recorded | None = None
        self._refused = ""
        self._status_due_ns = 0
        self._acts: Mapping[Any, Callable[[int, float], object]] = {
            "pause": lambda now_ns, _: self.pace.pause(now_ns, paused=True),
            "resume": lambda now_ns, _: self.pace.pause(now_ns, paused=False),
            "speed": self.pace.go_at,
            "seek": self.seek,
        }

    def start(self) -> None:
        """Open the topics, and show what was so where the replay begins."""
        self._requests = self._space.ring_reader("replay_request", from_start=False)
        self._status = self._space.cell_writer("replay_status")
        self._show_from(self.pace.position_ns(self._clock.now_ns()))

    def step(self) -> None:
        """Feed what is due by now."""
        now_ns = self._clock.now_ns()
        for event in self._requests.drain():
            self._heed(now_ns, event.payload)
        position_ns = self.pace.position_ns(now_ns)
        for _ in range(_AT_ONCE):
            if self._next is None or self._next.at_ns > position_ns:
                break
            self._feeder.feed(self._next)
            self._next = next(self._coming, None)
        if self._next is None and self._loop and not self.pace.is_paused:
            self.seek(now_ns, 0.0)
        if now_ns >= self._status_due_ns:
            self._status_due_ns = now_ns + _STATUS_EVERY_NS
            self._status.put_document(self.document(now_ns))
            if self.pace.is_paused or self._next is None:
                self._feeder.hold(position_ns)

    def stop(self) -> None:
        """Close the file and the topics."""
        self._source.close()
        self._space.close()

    def seek(self, now_ns: int, at_s: float) -> None:
        """Go on from another moment, `at_s` after the beginning.

        Raises:
            ReplayRefused: that is beyond the file.
        """
        self._show_from(self.pace.seek(now_ns, at_s))

    def document(self, now_ns: int) -> dict[str, Any]:
        """Return what `replay_status` tells."""
        pace, found = self.pace, self._source.summary
        state = "paused" if pace.is_paused else "ended" if self._next is None else "playing"
        return {
            "file": found.path.name,
            "kind": found.kind,
            "robot": found.robot,
            "run_id": found.run_id,
            "state": state,
            "position_s": round((pace.position_ns(now_ns) - pace.began_ns) / NS_PER_S, 3),
            "duration_s": round((pace.ended_ns - pace.began_ns) / NS_PER_S, 3),
            "began_s": round(pace.began_ns / NS_PER_S, 3),
            "speed": pace.speed,
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
        for message in self._source.before(at_ns, lasting):
            self._feeder.feed(message)
        self._coming = self._source.from_moment(at_ns)
        self._next = next(self._coming, None)

    def _heed(self, now_ns: int, request: Mapping[str, Any]) -> None:
        act, value = self._acts.get(request.get("act")), request.get("value", 0.0)
        try:
            if act is None or type(value) not in (int, float):
                raise ReplayRefused(f"expected one of {', '.join(self._acts)}, got {request!r:.80}")
            act(now_ns, float(value))
            self._refused = ""
        except ReplayRefused as refusal:
            self._refused = one_line(refusal)
            _log.warning("%s", refusal)
