"""Collect what is new in the topics; the writer's thread turns it into messages."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from vla_deploy.ipc import BY_NAME, Frame, Kind, Record
from vla_deploy.telemetry.channels import TICKS, tick_text, value_text
from vla_deploy.telemetry.history import Kept
from vla_deploy.telemetry.images import compress
from vla_deploy.telemetry.schemas.log_lines import LoggedLine

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


def messages_of(
    batch: Batch, wall_offset_ns: int, wanted: Callable[[str], bool]
) -> Iterator[Message]:
    """Yield the wanted messages of a batch; `wall_offset_ns` turns stamps into wall clock."""
    yield from _of_values((*batch.values, *_parts(batch.frames)), wall_offset_ns, wanted)
    for record in batch.ticks if wanted(TICKS) else ():
        text = tick_text(None, record.payload, record.writer_pid)
        yield Message(channel=TICKS, stamp_ns=record.stamp_ns, text=text, sequence=record.sequence)
    for line in batch.lines if wanted(LOG_CHANNEL) else ():
        yield Message(channel=LOG_CHANNEL, stamp_ns=line.stamp_ns, text=line.text(wall_offset_ns))


def _of_values(
    values: Iterable[tuple[str, Kept]], wall_offset_ns: int, wanted: Callable[[str], bool]
) -> Iterator[Message]:
    for channel, kept in values:
        if wanted(channel):
            yield Message(
                channel=channel,
                stamp_ns=kept.stamp_ns,
                text=value_text(channel, kept, wall_offset_ns),
                sequence=kept.sequence,
                stays=channel in BY_NAME and BY_NAME[channel].kind is Kind.CELL,
            )


def _parts(frames: Iterable[tuple[str, Frame]]) -> Iterator[tuple[str, Kept]]:
    for topic, frame in frames:
        for part, data in compress(frame).items():
            yield (
                f"{topic}/{part}",
                Kept(stamp_ns=frame.stamp_ns, sequence=frame.sequence, payload=data),
            )
