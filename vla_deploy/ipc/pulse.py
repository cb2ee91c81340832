"""Tell how far a topic of any kind has come, without copying what it carries."""

from dataclasses import dataclass

from drivers.clock import NS_PER_S
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.slot import SlotReader

_READ_ROUNDS = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulse:
    """Say which value is a topic's newest, when it was put, and by whom."""

    sequence: int
    stamp_ns: int
    writer_pid: int

    def age_s(self, now_ns: int) -> float:
        """Return how long ago the newest value was put."""
        return (now_ns - self.stamp_ns) / NS_PER_S


class PulseReader:
    """Feel the pulse of one topic; sequences count every value that was ever put."""

    def __init__(self, segment: Segment) -> None:
        self._segment = segment
        self._slots = SlotReader(segment.memory, segment.layout, payload_crc=False)

    def latest(self) -> Pulse | None:
        """Return the newest value's pulse, or None before the first and while it is written."""
        for _ in range(_READ_ROUNDS):
            newest = self._segment.newest
            origin = self._slots.origin(newest) if newest else None
            if origin is not None:
                return Pulse(sequence=newest, stamp_ns=origin[0], writer_pid=origin[1])
        return None

    def close(self) -> None:
        """Unmap the topic."""
        self._segment.close()
