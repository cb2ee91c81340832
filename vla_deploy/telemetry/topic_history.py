"""Remember the newest values of every topic, bounded by age and by bytes."""

from collections import deque
from typing import Final

from vla_deploy.ipc import Record, SharedSpace
from vla_deploy.telemetry.channels import TICKS, ChannelValue, TopicValue
from vla_deploy.telemetry.topic_follower import FrameFollower, TopicFollower, image_values
from vla_deploy.telemetry.triggers import KEPT_NS

LIMIT_BYTES: Final = 48 * 2**20
FRAME_PERIOD_S: Final = 2.0


class TopicHistory:
    """Keep the newest values of all topics; ticks stay in shared memory until they are needed.

    A cell that changes faster than `refresh` is called keeps what `refresh` saw.
    """

    def __init__(self, space: SharedSpace) -> None:
        self._values = BoundedValues(KEPT_NS, LIMIT_BYTES)
        self._ticks = space.record_reader(TICKS)
        self._follower = TopicFollower(space)
        self._frames = FrameFollower(space, FRAME_PERIOD_S)

    def refresh(self, now_ns: int) -> list[ChannelValue]:
        """Remember and return what is new; images are read only every `FRAME_PERIOD_S`."""
        new = list(self._follower.new_values())
        for name, frame in self._frames.new_frames(now_ns):
            new += image_values(name, frame)
        for channel, value in new:
            self._values.add(channel, value)
        self._values.drop_old(now_ns)
        return new

    def snapshot(self, now_ns: int) -> tuple[list[ChannelValue], list[Record]]:
        """Return all values and all ticks, by time."""
        return self._values.snapshot(), self._ticks.held(now_ns - KEPT_NS)

    def newest(self) -> list[ChannelValue]:
        """Return the newest value of every cell."""
        newest = ((name, self._values.newest(name)) for name in self._follower.cells)
        return [(name, value) for name, value in newest if value is not None]

    @property
    def held_bytes(self) -> int:
        """Return how many bytes are remembered, without the ticks."""
        return self._values.size_bytes


class BoundedValues:
    """Hold values per channel; beyond `limit_bytes` the largest channel loses its oldest."""

    def __init__(self, kept_ns: int, limit_bytes: int) -> None:
        self.dropped = 0
        self._kept_ns = kept_ns
        self._limit_bytes = limit_bytes
        self._values: dict[str, deque[TopicValue]] = {}
        self._bytes: dict[str, int] = {}

    def add(self, channel: str, value: TopicValue) -> None:
        """Hold one value more."""
        self._values.setdefault(channel, deque()).append(value)
        self._bytes[channel] = self._bytes.get(channel, 0) + len(value.payload)
        while self.size_bytes > self._limit_bytes:
            self._drop(max(self._bytes, key=self._bytes.__getitem__))
            self.dropped += 1

    def drop_old(self, now_ns: int) -> None:
        """Drop what is older than `kept_ns`, but for each channel's newest value."""
        for channel, values in self._values.items():
            while len(values) > 1 and now_ns - values[0].stamp_ns > self._kept_ns:
                self._drop(channel)

    def newest(self, channel: str) -> TopicValue | None:
        """Return the newest value of a channel."""
        values = self._values.get(channel)
        return values[-1] if values else None

    def snapshot(self) -> list[ChannelValue]:
        """Return everything, by time."""
        pairs = ((name, value) for name, values in self._values.items() for value in values)
        return sorted(pairs, key=lambda pair: pair[1].stamp_ns)

    @property
    def size_bytes(self) -> int:
        """Return how many bytes are held."""
        return sum(self._bytes.values())

    def _drop(self, channel: str) -> None:
        self._bytes[channel] -= len(self._values[channel].popleft().payload)
