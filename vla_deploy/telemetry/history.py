"""Remember the newest values of every topic, bounded by age and by bytes."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S

# 30 s before what happened, a few after it, and the time until it is written.
KEPT_NS: Final = 36 * NS_PER_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """Carry one remembered value: the JSON or the packed bytes of its topic."""

    stamp_ns: int
    sequence: int
    payload: bytes


class History:
    """Hold values per channel; beyond `limit_bytes` the one with most bytes loses its oldest."""

    def __init__(self, kept_ns: int, limit_bytes: int) -> None:
        self.dropped = 0
        self._kept_ns = kept_ns
        self._limit_bytes = limit_bytes
        self._values: dict[str, deque[Kept]] = {}
        self._bytes: dict[str, int] = {}

    def keep(self, channel: str, value: Kept) -> None:
        """Remember one value."""
        values = self._values.setdefault(channel, deque())
        values.append(value)
        self._bytes[channel] = self._bytes.get(channel, 0) + len(value.payload)
        while sum(self._bytes.values()) > self._limit_bytes:
            self._forget(max(self._bytes, key=self._bytes.__getitem__))
            self.dropped += 1

    def forget_old(self, now_ns: int) -> None:
        """Let go of what is older than what is to be kept, but for each channel's newest value."""
        for channel, values in self._values.items():
            while len(values) > 1 and now_ns - values[0].stamp_ns > self._kept_ns:
                self._forget(channel)

    def newest(self, channel: str) -> Kept | None:
        """Return the newest value of a channel."""
        values = self._values.get(channel)
        return values[-1] if values else None

    def snapshot(self) -> list[tuple[str, Kept]]:
        """Return everything, by time."""
        return sorted(self._all(), key=lambda pair: pair[1].stamp_ns)

    @property
    def size_bytes(self) -> int:
        """Return how many bytes are held."""
        return sum(self._bytes.values())

    def _all(self) -> Iterator[tuple[str, Kept]]:
        for channel, values in self._values.items():
            for value in values:
                yield channel, value

    def _forget(self, channel: str) -> None:
        self._bytes[channel] -= len(self._values[channel].popleft().payload)
