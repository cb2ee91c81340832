"""Produce and consume heartbeats on simulated time (CiA 301, 1016 and 1017)."""

from drivers.canopen.objects import HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER
from sim_twin.can.cia402.object_dictionary import ObjectDictionary

NS_PER_MS = 1_000_000
_NEVER = 1 << 62


class HeartbeatProducer:
    """Hold when the next heartbeat is due, which is not before `next_ns`."""

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self.next_ns = 0

    def due(self, now_ns: int) -> bool:
        """Return whether to send one now, and plan the next."""
        if now_ns < self.next_ns:
            return False
        period_ns = self._objects.get(HEARTBEAT_PRODUCER) * NS_PER_MS
        if not period_ns:
            return False
        self.next_ns = max(self.next_ns + period_ns, now_ns)
        return True


class HeartbeatConsumer:
    """Watch one producer from its first heartbeat on, as the standard has it.

    It is not missed up to and including `deadline_ns`.
    """

    def __init__(self, objects: ObjectDictionary) -> None:
        self._objects = objects
        self._heard_ns: int | None = None
        self.deadline_ns = _NEVER
        objects.after_write[HEARTBEAT_CONSUMER, 1] = self._plan

    @property
    def node_id(self) -> int:
        """Return the node that is watched; 0 is nobody."""
        return self._objects.get(HEARTBEAT_CONSUMER, 1) >> 16 & 0x7F

    def hear(self, now_ns: int) -> None:
        """Note a heartbeat of the watched node."""
        self._heard_ns = now_ns
        self._plan()

    def forget(self) -> None:
        """Watch again only after the next heartbeat."""
        self._heard_ns = None
        self._plan()

    def expired(self, now_ns: int) -> bool:
        """Return once that the producer has gone silent."""
        if now_ns <= self.deadline_ns:
            return False
        self.forget()
        return True

    def _plan(self) -> None:
        limit_ns = (self._objects.get(HEARTBEAT_CONSUMER, 1) & 0xFFFF) * NS_PER_MS
        heard_ns = self._heard_ns if limit_ns else None
        self.deadline_ns = _NEVER if heard_ns is None else heard_ns + limit_ns
