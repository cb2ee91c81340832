"""Let several processes change one document in turns."""

from collections.abc import Callable
from typing import Generic

from drivers.clock import Clock
from vla_deploy.ipc.memory.cell import CellReader, CellWriter
from vla_deploy.ipc.memory.segment import Segment
from vla_deploy.ipc.topics import P, Topic


class SharedDocument(Generic[P]):
    """Own one view of a cell that carries a document and has many writers.

    The memory is reserved when it is opened: no full disk stands in the way of a change. Who is
    killed half way leaves the document as it was, and the lock to the next.
    """

    def __init__(self, segment: Segment, topic: Topic[P], clock: Clock) -> None:
        self._segment = segment
        self._writer = CellWriter(segment, topic, clock)
        self._reader = CellReader(segment, topic)

    def change(self, change: Callable[[P | None], P]) -> P:
        """Put what `change` makes of the newest document, None before the first; return it.

        Nothing is put where nothing has changed, nor where `change` raises.

        Raises:
            BadPayload: what it makes is too long.
        """
        with self._segment.locked():
            newest = self._reader.latest()
            before = None if newest is None else newest.document()
            after = change(before)
            if after != before:
                self._writer.put_document(after)
        return after

    def close(self) -> None:
        """Unmap the cell; its newest value stays readable for others."""
        self._segment.close()
