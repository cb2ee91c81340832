"""Follow every topic of the run and remember its values."""

import json
from collections.abc import Iterator
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import TOPICS, CellReader, FrameReader, Kind, Record, RingReader, SharedSpace
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.history import KEPT_NS, History, Kept
from vla_deploy.telemetry.images import compress

LIMIT_BYTES: Final = 48 * 2**20
FRAME_PERIOD_S: Final = 2.0

Value = tuple[str, Kept]


class Memory:
    """Keep the newest values of all topics; ticks stay in shared memory until they are asked for.

    A cell that changes faster than `refresh` is called keeps what `refresh` saw.
    """

    def __init__(self, space: SharedSpace) -> None:
        self._history = History(KEPT_NS, LIMIT_BYTES)
        self._ticks = space.record_reader(TICKS)
        self._cells: dict[str, CellReader] = {}
        self._rings: dict[str, RingReader] = {}
        self._frames: dict[str, FrameReader] = {}
        self._frames_due_ns = 0
        for topic in TOPICS:
            match topic.kind:
                case Kind.CELL:
                    self._cells[topic.name] = space.cell_reader(topic.name)
                case Kind.RING:
                    self._rings[topic.name] = space.ring_reader(topic.name, from_start=True)
                case Kind.FRAME:
                    self._frames[topic.name] = space.frame_reader(topic.name)

    def refresh(self, now_ns: int) -> list[Value]:
        """Remember and return what is new; images are looked at only now and then."""
        new = [*self._new_values(), *self._new_events()]
        if now_ns >= self._frames_due_ns:
            self._frames_due_ns = now_ns + round(FRAME_PERIOD_S * NS_PER_S)
            new += self._new_images()
        for channel, kept in new:
            self._history.keep(channel, kept)
        self._history.forget_old(now_ns)
        return new

    def snapshot(self, now_ns: int) -> tuple[list[Value], list[Record]]:
        """Return all values and all ticks, by time."""
        return self._history.snapshot(), self._ticks.held(now_ns - KEPT_NS)

    @property
    def held_bytes(self) -> int:
        """Return how many bytes are remembered; ticks are not among them."""
        return self._history.size_bytes

    def _new_values(self) -> Iterator[Value]:
        for name, cell in self._cells.items():
            sample = cell.latest()
            if sample is not None and self._is_new(name, sample.sequence):
                yield name, _kept(sample.stamp_ns, sample.sequence, sample.payload)

    def _new_events(self) -> Iterator[Value]:
        for name, ring in self._rings.items():
            for event in ring.drain():
                text = json.dumps(event.payload, separators=(",", ":")).encode()
                yield name, _kept(event.stamp_ns, event.sequence, text)

    def _new_images(self) -> Iterator[Value]:
        for name, frames in self._frames.items():
            frame = frames.latest()
            if frame is None or not self._is_new(f"{name}/colour", frame.sequence):
                continue
            for part, data in compress(frame).items():
                yield f"{name}/{part}", _kept(frame.stamp_ns, frame.sequence, data)

    def _is_new(self, channel: str, sequence: int) -> bool:
        known = self._history.newest(channel)
        return known is None or known.sequence != sequence


def _kept(stamp_ns: int, sequence: int, payload: bytes) -> Kept:
    return Kept(stamp_ns=stamp_ns, sequence=sequence, payload=payload)
