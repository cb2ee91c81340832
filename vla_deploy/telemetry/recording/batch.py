"""Collect what is new in the topics; the writer's thread turns it into messages."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from vla_deploy.ipc import BY_NAME, Frame, Record, TopicKind
from vla_deploy.robots import load_robot
from vla_deploy.telemetry.channels import TICKS, tick_text, value_text
from vla_deploy.telemetry.history import Kept
from vla_deploy.telemetry.images import compress
from vla_deploy.telemetry.schemas.log_lines import LoggedLine
from vla_deploy.telemetry.schemas.pictures import Pictures

LOG_CHANNEL: Final = "view/log"
_LINE_BYTES: Final = 300


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Carry the new values of one look; images as they are, ticks as control packed them."""

    values: tuple[tuple[str, Kept], ...] = ()
    frames: tuple[tuple[str, Frame], ...] = ()
    ticks: tuple[Record, ...] = ()
    lines: tuple[LoggedLine, ...] = ()

    @property
    def count(self) -> int:
        """Return how many values it carries."""
        return len(self.values) + len(self.frames) + len(self.ticks) + len(self.lines)

    @property
    def size_bytes(self) -> int:
        """Return about how much memory it holds."""
        return (
            sum(len(kept.payload) for _, kept in self.values)
            + sum(len(frame.payload) for _, frame in self.frames)
            + sum(len(record.payload) for record in self.ticks)
            + _LINE_BYTES * len(self.lines)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """Carry one message; `stamp_ns` is in the run's clock, `stays` tells that its value lasts."""

    channel: str
    stamp_ns: int
    text: bytes
    sequence: int = 0
    stays: bool = False


class Drafter:
    """Turn batches into messages: of the topics themselves, and of the views of them."""

    def __init__(self, robot: str, wanted: Callable[[str], bool]) -> None:
        self._robot = robot
        self._wanted = wanted
        self._pictures: Pictures | None = None

    def messages(self, batch: Batch, wall_offset_ns: int) -> Iterator[Message]:
        """Yield the wanted messages; `wall_offset_ns` turns stamps into wall clock."""
        for channel, kept in (*batch.values, *_parts(batch.frames)):
            if self._wanted(channel):
                yield _of_value(channel, kept, wall_offset_ns)
            yield from self._views(channel, kept, wall_offset_ns)
        for record in batch.ticks if self._wanted(TICKS) else ():
            text = tick_text(None, record.payload, record.writer_pid)
            yield Message(
                channel=TICKS, stamp_ns=record.stamp_ns, text=text, sequence=record.sequence
            )
        for line in batch.lines if self._wanted(LOG_CHANNEL) else ():
            yield Message(
                channel=LOG_CHANNEL, stamp_ns=line.stamp_ns, text=line.text(wall_offset_ns)
            )

    def still(self, now_ns: int, wall_offset_ns: int) -> Iterator[Message]:
        """Yield what stays as it is while the robot runs."""
        for channel, text in self._drawn().still(now_ns + wall_offset_ns, self._wanted):
            yield Message(channel=channel, stamp_ns=now_ns, text=text)

    def _views(self, channel: str, kept: Kept, wall_offset_ns: int) -> Iterator[Message]:
        stamp_ns = kept.stamp_ns + wall_offset_ns
        for view, text in self._drawn().of(channel, kept.payload, stamp_ns, self._wanted):
            yield Message(
                channel=view,
                stamp_ns=kept.stamp_ns,
                text=text,
                sequence=kept.sequence,
                stays=True,
            )

    def _drawn(self) -> Pictures:
        """Return the views of the robot; its kinematics are loaded when they are first needed."""
        if self._pictures is None:
            self._pictures = Pictures(load_robot(self._robot))
        return self._pictures


def _of_value(channel: str, kept: Kept, wall_offset_ns: int) -> Message:
    return Message(
        channel=channel,
        stamp_ns=kept.stamp_ns,
        text=value_text(channel, kept, wall_offset_ns),
        sequence=kept.sequence,
        stays=channel in BY_NAME and BY_NAME[channel].kind is TopicKind.CELL,
    )


def _parts(frames: Iterable[tuple[str, Frame]]) -> Iterator[tuple[str, Kept]]:
    for topic, frame in frames:
        for part, data in compress(frame).items():
            yield (
                f"{topic}/{part}",
                Kept(stamp_ns=frame.stamp_ns, sequence=frame.sequence, payload=data),
            )
