"""Make live topics of the schema table: documents pass as they are, fields become objects."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from vla_deploy.dashboard.live.feed import Feed
from vla_deploy.dashboard.live.message import Message, Moment, json_message, text_message
from vla_deploy.ipc import TOPICS, CellReader, RingReader, Sample, SharedSpace, Topic, TopicKind
from vla_deploy.ipc.memory.layout import is_document

FASTEST_S: Final = 0.1
ON_CHANGE_S: Final = 0.5
EVENTS_S: Final = 0.05
DIGITS: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Packing:
    """Say how the packed fields of a topic are told: which, how exactly, and how many of each.

    `counted_by` names the field that says how many entries of the arrays are used.
    """

    fields: tuple[str, ...] = ()
    digits: int = DIGITS
    counted_by: str = ""


PACKINGS: Final[Mapping[str, Packing]] = {
    "joint_state": Packing(counted_by="joint_count"),
    "near_obstacles": Packing(counted_by="count", digits=3),
    "scan": Packing(fields=("range_m",), digits=3),
}
PERIODS_S: Final[Mapping[str, float]] = {"scan": 0.2}
"""What is told less often than its rate and `FASTEST_S` would have it."""


class CellFeed:
    """Tell the newest value of a cell, once."""

    def __init__(self, topic: Topic, cell: CellReader, extra: Mapping[str, Any]) -> None:
        """Take `extra`, which every value of packed fields is told with."""
        self.topic = topic.name
        self.period_s = period_s_of(topic)
        self._declared = topic
        self._cell = cell
        self._extra = extra
        self._told = 0

    def begin(self) -> None:
        """Tell the newest value again."""
        self._told = 0

    def look(self, now: Moment) -> Sequence[Message]:
        """Return the value, if it is a new one."""
        sample = self._cell.latest()
        if sample is None or sample.sequence == self._told:
            return ()
        self._told = sample.sequence
        if is_document(self._declared):
            return (text_message(self.topic, sample.stamp_ns, now, sample.payload),)
        data = {**self._extra, **unpacked(sample, self._declared)}
        return (json_message(self.topic, sample.stamp_ns, now, data),)


class RingFeed:
    """Tell every event of a ring."""

    period_s = EVENTS_S

    def __init__(self, topic: Topic, ring: RingReader) -> None:
        self.topic = topic.name
        self._ring = ring

    @property
    def lost(self) -> int:
        """Return how many events were overwritten before this process read them."""
        return self._ring.lost + self._ring.torn

    def begin(self) -> None:
        """Pass over what has happened so far: the API tells that."""
        self._ring.drain()

    def look(self, now: Moment) -> Sequence[Message]:
        """Return the events since the last look."""
        return [
            json_message(self.topic, event.stamp_ns, now, event.payload, queued=True)
            for event in self._ring.drain()
        ]


def topic_feeds(space: SharedSpace, joint_names: Sequence[str]) -> list[Feed]:
    """Return a feed for each cell and each event ring of the schema table."""
    extra = {"joint_state": {"names": list(joint_names)}}
    make: Mapping[TopicKind, Callable[[Topic], Feed]] = {
        TopicKind.CELL: lambda topic: CellFeed(
            topic, space.cell_reader(topic.name), extra.get(topic.name, {})
        ),
        TopicKind.RING: lambda topic: RingFeed(
            topic, space.ring_reader(topic.name, from_start=False)
        ),
    }
    return [make[topic.kind](topic) for topic in TOPICS if topic.kind in make]


def period_s_of(topic: Topic) -> float:
    """Return how often at most a cell is told."""
    own_s = 1.0 / topic.rate_hz if topic.rate_hz else ON_CHANGE_S
    return PERIODS_S.get(topic.name, max(FASTEST_S, own_s))


def unpacked(sample: Sample, topic: Topic) -> dict[str, Any]:
    """Return packed fields as JSON takes them: rounded, arrays as long as they are used."""
    packing = PACKINGS.get(topic.name, Packing())
    record = sample.data
    used = int(record[packing.counted_by]) if packing.counted_by else None
    names = packing.fields or tuple(field.name for field in topic.fields)
    return {name: _plain(record[name], packing.digits, used) for name in names}


def _plain(value: Any, digits: int, used: int | None) -> Any:
    """Return a number or a list; None where it is not finite, which JSON cannot say."""
    array = np.asarray(value)
    if array.dtype.kind != "f":
        return array[:used].tolist() if array.ndim else array.item()
    exact = np.round(array.astype(np.float64), digits)
    if array.ndim:
        exact = exact[:used]
    if np.isfinite(exact).all():
        return exact.tolist()
    return json.loads(json.dumps(exact.tolist()), parse_constant=lambda _: None)
