"""Follow every topic of the run and remember its values."""

from collections.abc import Iterator
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import TOPICS, FrameReader, Record, SharedSpace, TopicKind
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.following import Following, Value
from vla_deploy.telemetry.history import KEPT_NS, History, Kept
from vla_deploy.telemetry.images import compress

LIMIT_BYTES: Final = 48 * 2**20
FRAME_PERIOD_S: Final = 2.0


class Memory:
    """Keep the newest values of all topics; ticks stay in shared memory until they are asked for.

    A cell that changes faster than `refresh` is called keeps what `refresh` saw.
    """

    def __init__(self, space: SharedSpace) -> None:
        self._history = History(KEPT_NS, LIMIT_BYTES)
        self._ticks = space.record_reader(TICKS)
        self._following = Following(space)
        self._frames: dict[str, FrameReader] = {
            topic.name: space.frame_reader(topic.name)
            for topic in TOPICS
            if topic.kind is TopicKind.FRAME
        }
        self._frames_due_ns = 0

    def refresh(self, now_ns: int) -> list[Value]:
        """Remember and return what is new; images are looked at only now and then."""
        new = list(self._following.fresh())
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

    def newest(self) -> list[Value]:
        """Return the newest value of every cell."""
        newest = ((name, self._history.newest(name)) for name in self._following.cells)
        return [(name, kept) for name, kept in newest if kept is not None]

    @property
    def held_bytes(self) -> int:
        """Return how many bytes are remembered; ticks are not among them."""
        return self._history.size_bytes

    def _new_images(self) -> Iterator[Value]:
        for name, frames in self._frames.items():
            frame = frames.latest()
            if frame is None or not self._is_new(f"{name}/colour", frame.sequence):
                continue
            for part, data in compress(frame).items():
                yield (
                    f"{name}/{part}",
                    Kept(stamp_ns=frame.stamp_ns, sequence=frame.sequence, payload=data),
                )

    def _is_new(self, channel: str, sequence: int) -> bool:
        known = self._history.newest(channel)
        return known is None or known.sequence != sequence
