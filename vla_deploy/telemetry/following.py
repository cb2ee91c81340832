"""Follow the cells and rings of a run: what is new in them since the last look."""

import json
from collections.abc import Callable, Iterator

from vla_deploy.ipc import TOPICS, CellReader, RingReader, SharedSpace, TopicKind
from vla_deploy.telemetry.history import Kept

Value = tuple[str, Kept]


class Following:
    """Look at every wanted cell and ring; a cell that changes faster than looks loses values."""

    def __init__(
        self,
        space: SharedSpace,
        *,
        from_start: bool = True,
        wanted: Callable[[str], bool] = lambda _: True,
    ) -> None:
        self._cells: dict[str, CellReader] = {}
        self._rings: dict[str, RingReader] = {}
        self._sequences: dict[str, int] = {}
        for topic in TOPICS:
            if topic.kind is TopicKind.CELL and wanted(topic.name):
                self._cells[topic.name] = space.cell_reader(topic.name)
            elif topic.kind is TopicKind.RING and wanted(topic.name):
                self._rings[topic.name] = space.ring_reader(topic.name, from_start=from_start)

    @property
    def cells(self) -> tuple[str, ...]:
        """Return the names of the cells."""
        return tuple(self._cells)

    def fresh(self) -> Iterator[Value]:
        """Yield what is new: of a cell its newest value, of a ring every event."""
        for name, cell in self._cells.items():
            sample = cell.latest()
            if sample is not None and self._sequences.get(name) != sample.sequence:
                self._sequences[name] = sample.sequence
                yield name, _kept(sample.stamp_ns, sample.sequence, sample.payload)
        for name, ring in self._rings.items():
            for event in ring.drain():
                text = json.dumps(event.payload, separators=(",", ":")).encode()
                yield name, _kept(event.stamp_ns, event.sequence, text)


def _kept(stamp_ns: int, sequence: int, payload: bytes) -> Kept:
    return Kept(stamp_ns=stamp_ns, sequence=sequence, payload=payload)
