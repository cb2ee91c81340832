"""Collect what is new in a run, and turn it into the messages of files and viewers."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import BY_NAME, Frame, Record, SharedSpace, TopicKind
from vla_deploy.robots import load_robot
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.node import NodeContext
from vla_deploy.supervisor.runs.log_files import LogTail, processes_in
from vla_deploy.telemetry.channels import (
    TICKS,
    ChannelValue,
    TopicValue,
    tick_text,
    value_text,
)
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.schemas.foxglove_json import LOG_LEVELS, time_json
from vla_deploy.telemetry.schemas.views import LOG, ViewDrawer
from vla_deploy.telemetry.topic_follower import FrameFollower, TopicFollower, image_values

_LINE_BYTES: Final = 300
_LOG_PERIOD_NS: Final = NS_PER_S // 2


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedLine:
    """Carry one line of a log; `stamp_ns` is in the run's clock."""

    stamp_ns: int
    line: Mapping[str, Any]

    def text(self, wall_offset_ns: int) -> bytes:
        """Return it as `foxglove.Log`; `wall_offset_ns` turns the stamp into wall clock."""
        line = self.line
        level = str(line.get("level"))
        message = {
            "timestamp": time_json(self.stamp_ns + wall_offset_ns),
            "level": LOG_LEVELS.index(level) if level in LOG_LEVELS else 0,
            "message": "\n".join(str(line[key]) for key in ("message", "traceback") if key in line),
            "name": str(line.get("process", "")),
            "file": str(line.get("file", "")),
            "line": int(line.get("line", 0)),
        }
        return json.dumps(message).encode()


class RunLogs:
    """Follow the logs of every process of a run, from their beginning."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._tails: dict[str, LogTail] = {}

    def new_lines(self) -> Iterator[LoggedLine]:
        """Yield the lines since the last call, the oldest first."""
        for process in processes_in(self._folder):
            self._tails.setdefault(process, LogTail(self._folder, process))
        lines = [line for tail in self._tails.values() for line in tail.fresh()]
        for line in sorted(lines, key=_stamp_ns):
            yield LoggedLine(stamp_ns=_stamp_ns(line), line=line)


def _stamp_ns(line: Mapping[str, Any]) -> int:
    stamp = line.get("stamp_ns")
    return stamp if isinstance(stamp, int) else 0


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicBatch:
    """Carry new values; images as they are, ticks as control packed them."""

    values: tuple[ChannelValue, ...] = ()
    frames: tuple[tuple[str, Frame], ...] = ()
    ticks: tuple[Record, ...] = ()
    lines: tuple[LoggedLine, ...] = ()

    @property
    def count(self) -> int:
        """Return how many values it carries."""
        return len(self.values) + len(self.frames) + len(self.ticks) + len(self.lines)

    @property
    def size_bytes(self) -> int:
        """Return its approximate size in memory."""
        return (
            sum(len(value.payload) for _, value in self.values)
            + sum(len(frame.payload) for _, frame in self.frames)
            + sum(len(record.payload) for record in self.ticks)
            + _LINE_BYTES * len(self.lines)
        )


class Collector:
    """Collect the chosen topics; images at their own rate, log lines from now on."""

    def __init__(
        self, space: SharedSpace, run_dir: Path, selection: ChannelSelection, image_period_s: float
    ) -> None:
        self._takes = selection.takes
        self._ticks = space.record_reader(TICKS)
        self._frames = FrameFollower(space, image_period_s, selection.takes_any_of)
        self._logs = RunLogs(run_dir / LOGS_DIR)
        self._logs_due_ns = 0
        for _ in self._logs.new_lines():  # skip what was logged before
            pass

    def batch(self, now_ns: int, values: Iterable[ChannelValue]) -> TopicBatch:
        """Return what is new, with `values` of cells and rings from a `TopicFollower`."""
        return TopicBatch(
            values=tuple((name, value) for name, value in values if "/" not in name),
            frames=tuple(self._frames.new_frames(now_ns)),
            ticks=tuple(self._ticks.fresh()) if self._takes(TICKS) else (),
            lines=tuple(self._new_lines(now_ns)),
        )

    def _new_lines(self, now_ns: int) -> list[LoggedLine]:
        if now_ns < self._logs_due_ns or not self._takes(LOG):
            return []
        self._logs_due_ns = now_ns + _LOG_PERIOD_NS
        return list(self._logs.new_lines())


@dataclass(frozen=True, slots=True, kw_only=True)
class DraftMessage:
    """Carry one message; `stamp_ns` is in the run's clock.

    A message that `stays` is valid until the next one of its channel.
    """

    channel: str
    stamp_ns: int
    text: bytes
    sequence: int = 0
    stays: bool = False


class MessageDrafter:
    """Turn batches into messages of the topics themselves and of their views."""

    def __init__(self, robot: str, wanted: Callable[[str], bool]) -> None:
        self._robot = robot
        self._wanted = wanted
        self._loaded_drawer: ViewDrawer | None = None

    def messages(self, batch: TopicBatch, wall_offset_ns: int) -> Iterator[DraftMessage]:
        """Yield the wanted messages; `wall_offset_ns` turns stamps into wall clock."""
        images = (pair for name, frame in batch.frames for pair in image_values(name, frame))
        for channel, value in (*batch.values, *images):
            if self._wanted(channel):
                yield _of_value(channel, value, wall_offset_ns)
            yield from self._views(channel, value, wall_offset_ns)
        for record in batch.ticks if self._wanted(TICKS) else ():
            text = tick_text(None, record.payload, record.writer_pid)
            yield DraftMessage(
                channel=TICKS, stamp_ns=record.stamp_ns, text=text, sequence=record.sequence
            )
        for line in batch.lines if self._wanted(LOG) else ():
            yield DraftMessage(channel=LOG, stamp_ns=line.stamp_ns, text=line.text(wall_offset_ns))

    def constant_views(self, now_ns: int, wall_offset_ns: int) -> Iterator[DraftMessage]:
        """Yield the views that do not change while the robot runs."""
        for channel, text in self._drawer().constant_views(now_ns + wall_offset_ns, self._wanted):
            yield DraftMessage(channel=channel, stamp_ns=now_ns, text=text)

    def _views(
        self, channel: str, value: TopicValue, wall_offset_ns: int
    ) -> Iterator[DraftMessage]:
        stamp_ns = value.stamp_ns + wall_offset_ns
        for view, text in self._drawer().views_of(channel, value.payload, stamp_ns, self._wanted):
            yield DraftMessage(
                channel=view,
                stamp_ns=value.stamp_ns,
                text=text,
                sequence=value.sequence,
                stays=True,
            )

    def _drawer(self) -> ViewDrawer:
        """Return the drawer of views; the robot's kinematics are loaded when first needed."""
        if self._loaded_drawer is None:
            self._loaded_drawer = ViewDrawer(load_robot(self._robot))
        return self._loaded_drawer


def _of_value(channel: str, value: TopicValue, wall_offset_ns: int) -> DraftMessage:
    return DraftMessage(
        channel=channel,
        stamp_ns=value.stamp_ns,
        text=value_text(channel, value, wall_offset_ns),
        sequence=value.sequence,
        stays=channel in BY_NAME and BY_NAME[channel].kind is TopicKind.CELL,
    )


class RunMessages:
    """Follow a run from now on, as messages of the wanted channels."""

    def __init__(
        self,
        space: SharedSpace,
        context: NodeContext,
        selection: ChannelSelection,
        *,
        image_period_s: float,
        wanted: Callable[[str], bool],
    ) -> None:
        self._follower = TopicFollower(space, from_start=False)
        self._collector = Collector(space, context.run_dir, selection, image_period_s)
        self._drafter = MessageDrafter(context.robot, wanted)

    def new(self, now_ns: int, wall_offset_ns: int) -> Iterator[DraftMessage]:
        """Yield what is new; `wall_offset_ns` turns stamps into wall clock."""
        batch = self._collector.batch(now_ns, self._follower.new_values())
        return self._drafter.messages(batch, wall_offset_ns)

    def constant_views(self, now_ns: int, wall_offset_ns: int) -> Iterator[DraftMessage]:
        """Yield the views that do not change while the robot runs."""
        return self._drafter.constant_views(now_ns, wall_offset_ns)
