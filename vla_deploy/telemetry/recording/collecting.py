"""Collect for one recording what is not followed anyway: images, ticks, lines of the logs."""

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import TOPICS, Frame, FrameReader, SharedSpace, TopicKind
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.following import Value
from vla_deploy.telemetry.recording.batch import LOG_CHANNEL, Batch
from vla_deploy.telemetry.recording.selection import Selection
from vla_deploy.telemetry.schemas.log_lines import LoggedLine, RunLogs

_LOGS_EVERY_NS: Final = NS_PER_S // 2


class Collector:
    """Look at the wanted topics; images at their own pace, of the logs what comes from now on."""

    def __init__(
        self, space: SharedSpace, logs: Path, selection: Selection, image_period_s: float
    ) -> None:
        self._takes = selection.takes
        self._image_period_ns = round(image_period_s * NS_PER_S)
        self._ticks = space.record_reader(TICKS)
        self._frames: dict[str, FrameReader] = {
            topic.name: space.frame_reader(topic.name)
            for topic in TOPICS
            if topic.kind is TopicKind.FRAME and selection.takes_any_of(topic.name)
        }
        self._sequences: dict[str, int] = {}
        self._logs = RunLogs(logs)
        self._images_due_ns = self._logs_due_ns = 0
        for _ in self._logs.fresh():  # what was logged before is in the logs
            pass

    def batch(self, now_ns: int, values: Iterable[Value]) -> Batch:
        """Return what is new, with the values of cells and rings that somebody else follows."""
        return Batch(
            values=tuple((name, kept) for name, kept in values if "/" not in name),
            frames=tuple(self._new_frames(now_ns)),
            ticks=tuple(self._ticks.fresh()) if self._takes(TICKS) else (),
            lines=tuple(self._new_lines(now_ns)),
        )

    def _new_frames(self, now_ns: int) -> list[tuple[str, Frame]]:
        if now_ns < self._images_due_ns:
            return []
        self._images_due_ns = now_ns + self._image_period_ns
        new = []
        for name, reader in self._frames.items():
            frame = reader.latest()
            if frame is not None and self._sequences.get(name) != frame.sequence:
                self._sequences[name] = frame.sequence
                new.append((name, frame))
        return new

    def _new_lines(self, now_ns: int) -> list[LoggedLine]:
        if now_ns < self._logs_due_ns or not self._takes(LOG_CHANNEL):
            return []
        self._logs_due_ns = now_ns + _LOGS_EVERY_NS
        return list(self._logs.fresh())
