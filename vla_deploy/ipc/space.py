"""Open the topics of one run by name."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drivers.clock import Clock
from vla_deploy.ipc.errors import SpaceUnavailable, UnknownTopic
from vla_deploy.ipc.memory.cell import CellReader, CellWriter
from vla_deploy.ipc.memory.doorbell import Doorbell
from vla_deploy.ipc.memory.frame_ring import FrameReader, FrameWriter
from vla_deploy.ipc.memory.record_ring import RecordReader, RecordWriter
from vla_deploy.ipc.memory.ring import RingReader, RingWriter
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.memory.shared_document import SharedDocument
from vla_deploy.ipc.pulse import PulseReader
from vla_deploy.ipc.replay_mark import refuse_in_replay
from vla_deploy.ipc.topics import TOPICS, P, Topic, TopicKind


class SharedSpace:
    """Give access to the shared memory of one run; the first process makes the files.

    A topic of the table brings the type of its payload along, a bare name does not. Every method
    but `doorbell` may raise `UnknownTopic`, `SchemaMismatch` or `SpaceUnavailable`; in a replay,
    which `is_replay` alone may write, every writer raises `ReplayOnly`.

    Raises:
        SpaceUnavailable: the directory cannot be made.
    """

    def __init__(
        self,
        directory: Path,
        clock: Clock,
        topics: Iterable[Topic[Any]] = TOPICS,
        *,
        is_replay: bool = False,
    ) -> None:
        self._directory = directory
        self._is_replay = is_replay
        self._clock = clock
        self._topics = {topic.name: topic for topic in topics}
        self._opened: list[Segment | Doorbell] = []
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise SpaceUnavailable(f"{directory}: cannot make it: {error.strerror}") from error

    def cell_writer(self, topic: Topic[P] | str) -> CellWriter[P]:
        """Open a latest-value cell as its owner."""
        declared = self._topic(topic, TopicKind.CELL)
        return CellWriter(self._segment(declared, writable=True), declared, self._clock)

    def cell_reader(self, topic: Topic[P] | str) -> CellReader[P]:
        """Open a latest-value cell for reading."""
        declared = self._topic(topic, TopicKind.CELL)
        return CellReader(self._segment(declared, writable=False), declared)

    def shared_document(self, topic: Topic[P] | str) -> SharedDocument[P]:
        """Open a cell whose document several processes change in turns."""
        declared = self._topic(topic, TopicKind.CELL)
        return SharedDocument(self._segment(declared, writable=True), declared, self._clock)

    def ring_writer(self, topic: Topic[P] | str) -> RingWriter[P]:
        """Open an event ring for publishing."""
        declared = self._topic(topic, TopicKind.RING)
        return RingWriter(self._segment(declared, writable=True), declared, self._clock)

    def ring_reader(self, topic: Topic[P] | str, *, from_start: bool) -> RingReader[P]:
        """Open an event ring for reading, from its oldest event or from now on."""
        declared = self._topic(topic, TopicKind.RING)
        return RingReader(self._segment(declared, writable=False), from_start=from_start)

    def frame_writer(self, topic: Topic[Any] | str) -> FrameWriter:
        """Open a frame ring as its owner."""
        declared = self._topic(topic, TopicKind.FRAME)
        return FrameWriter(self._segment(declared, writable=True), declared)

    def frame_reader(self, topic: Topic[Any] | str) -> FrameReader:
        """Open a frame ring for reading."""
        return FrameReader(self._segment(self._topic(topic, TopicKind.FRAME), writable=False))

    def record_writer(self, topic: Topic[Any] | str) -> RecordWriter:
        """Open a record ring as its owner."""
        declared = self._topic(topic, TopicKind.RECORD)
        return RecordWriter(self._segment(declared, writable=True), declared, self._clock)

    def record_reader(self, topic: Topic[Any] | str) -> RecordReader:
        """Open a record ring for reading."""
        return RecordReader(self._segment(self._topic(topic, TopicKind.RECORD), writable=False))

    def pulse_reader(self, topic: Topic[Any] | str) -> PulseReader:
        """Follow how often a topic of any kind is written, and when it was last."""
        return PulseReader(self._segment(self._topic(topic, *TopicKind), writable=False))

    def doorbell(self, topic: Topic[Any] | str) -> Doorbell:
        """Listen for the writers of an event or frame ring.

        Raises:
            UnknownTopic: no such topic, or a cell: cells are polled, they ring no bell.
        """
        declared = self._topic(topic, TopicKind.RING, TopicKind.FRAME)
        bell = Doorbell(self._directory, declared.name, self._clock)
        self._opened.append(bell)
        return bell

    def close(self) -> None:
        """Close everything that was opened here; what was read stays valid."""
        for opened in self._opened:
            opened.close()
        self._opened.clear()

    def _segment(self, topic: Topic[Any], *, writable: bool) -> Segment:
        if writable and not self._is_replay:
            refuse_in_replay(self._directory, topic)
        segment = Segment(self._directory, topic, writable=writable)
        self._opened.append(segment)
        return segment

    def _topic(self, wanted: Topic[P] | str, *kinds: TopicKind) -> Topic[P]:
        name = wanted if isinstance(wanted, str) else wanted.name
        topic = self._topics.get(name)
        if topic is None:
            known = ", ".join(sorted(self._topics))
            raise UnknownTopic(f"no topic {name!r}; topics.py declares: {known}")
        if topic.kind not in kinds:
            kind = " or ".join(kind.value for kind in kinds)
            raise UnknownTopic(f"topic {name!r} is a {topic.kind.value}, not a {kind}")
        return topic
