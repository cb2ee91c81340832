"""Make live topics from the schema table, a table of all topics' rates, and the robot's path."""

import json
import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.place_state import PlaceState
from vla_deploy.dashboard.live.message import (
    LiveFeed,
    LiveMessage,
    LookTime,
    json_message,
    text_message,
)
from vla_deploy.ipc import (
    TOPICS,
    CellReader,
    PulseReader,
    RingReader,
    Sample,
    SharedSpace,
    Topic,
    TopicKind,
    topics,
)
from vla_deploy.ipc.memory.layout import is_document

FASTEST_S: Final = 0.1
ON_CHANGE_S: Final = 0.5
EVENTS_S: Final = 0.05
DIGITS: Final = 4
PERIODS_S: Final[Mapping[str, float]] = {"scan": 0.2, "live_obstacles": 0.2}
"""Topics that are sent less often than their rate and `FASTEST_S` allow."""
TABLE_PERIOD_S: Final = 0.5
WINDOW_S: Final = 4.0
"""Rates are measured over this time: values are counted, and tables come twice a second."""
MOST_POINTS: Final = 600
STEP_M: Final = 0.05
_STALE_S: Final = 1.0
_FOLLOW_NS: Final = NS_PER_S // 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Packing:
    """Describe how packed fields become JSON: which fields, and how many digits.

    `counted_by` names the field that has the number of used array entries, for all arrays or for
    each.
    """

    fields: tuple[str, ...] = ()
    digits: int = DIGITS
    counted_by: str | Mapping[str, str] = ""


PACKINGS: Final[Mapping[str, Packing]] = {
    "joint_state": Packing(counted_by="joint_count"),
    "live_obstacles": Packing(
        digits=3,
        counted_by={
            **dict.fromkeys(("x_m", "y_m"), "count"),
            **dict.fromkeys(
                ("mover_x_m", "mover_y_m", "mover_vx_m_s", "mover_vy_m_s"), "mover_count"
            ),
        },
    ),
    "near_obstacles": Packing(counted_by="count", digits=3),
    "scan": Packing(fields=("range_m",), digits=3),
}


class CellFeed:
    """Send the newest value of a cell, once."""

    def __init__(self, topic: Topic[Any], cell: CellReader, extra: Mapping[str, Any]) -> None:
        """Take `extra`, which is added to every value of packed fields."""
        self.topic = topic.name
        self.period_s = period_s_of(topic)
        self._declared = topic
        self._cell = cell
        self._extra = extra
        self._sent = 0

    def begin(self) -> None:
        """Send the newest value again."""
        self._sent = 0

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return the value, if it is new."""
        sample = self._cell.latest()
        if sample is None or sample.sequence == self._sent:
            return ()
        self._sent = sample.sequence
        if is_document(self._declared):
            return (text_message(self.topic, sample.stamp_ns, now, sample.payload),)
        data = {**self._extra, **unpacked(sample, self._declared)}
        return (json_message(self.topic, sample.stamp_ns, now, data),)


class RingFeed:
    """Send every event of a ring."""

    period_s = EVENTS_S

    def __init__(self, topic: Topic[Any], ring: RingReader) -> None:
        self.topic = topic.name
        self._ring = ring

    @property
    def lost(self) -> int:
        """Return how many events were overwritten before this process read them."""
        return self._ring.lost + self._ring.torn

    def begin(self) -> None:
        """Skip past events, which the API answers."""
        self._ring.drain()

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return the events since the last look."""
        return [
            json_message(self.topic, event.stamp_ns, now, event.payload, queued=True)
            for event in self._ring.drain()
        ]


def topic_feeds(space: SharedSpace, joint_names: Sequence[str]) -> list[LiveFeed]:
    """Return a feed for each cell and each event ring of the schema table."""
    extra = {"joint_state": {"names": list(joint_names)}}
    make: Mapping[TopicKind, Callable[[Topic[Any]], LiveFeed]] = {
        TopicKind.CELL: lambda topic: CellFeed(
            topic, space.cell_reader(topic.name), extra.get(topic.name, {})
        ),
        TopicKind.RING: lambda topic: RingFeed(
            topic, space.ring_reader(topic.name, from_start=False)
        ),
    }
    return [make[topic.kind](topic) for topic in TOPICS if topic.kind in make]


def period_s_of(topic: Topic[Any]) -> float:
    """Return the shortest time between two messages of a cell."""
    own_s = 1.0 / topic.rate_hz if topic.rate_hz else ON_CHANGE_S
    return PERIODS_S.get(topic.name, max(FASTEST_S, own_s))


def unpacked(sample: Sample, topic: Topic[Any]) -> dict[str, Any]:
    """Return packed fields as JSON values: rounded, arrays cut to their used length."""
    packing = PACKINGS.get(topic.name, Packing())
    record = sample.data
    names = packing.fields or tuple(field.name for field in topic.fields)
    counted = packing.counted_by
    counts = dict.fromkeys(names, counted) if isinstance(counted, str) else counted
    used = {name: int(record[counts[name]]) if counts.get(name) else None for name in names}
    return {name: _plain(record[name], packing.digits, used[name]) for name in names}


def _plain(value: Any, digits: int, used: int | None) -> Any:
    """Return a number or a list; None for numbers that are not finite, as JSON has none."""
    array = np.asarray(value)
    if array.dtype.kind != "f":
        return array[:used].tolist() if array.ndim else array.item()
    exact = np.round(array.astype(np.float64), digits)
    if array.ndim:
        exact = exact[:used]
    if np.isfinite(exact).all():
        return exact.tolist()
    return json.loads(json.dumps(exact.tolist()), parse_constant=lambda _: None)


class _Counted:
    """Measure the rate of one topic by its sequence."""

    def __init__(self, pulse: PulseReader) -> None:
        self.pulse = pulse
        self._counts: deque[tuple[int, int]] = deque()

    def begin(self) -> None:
        self._counts.clear()

    def rate_hz(self, now_ns: int, sequence: int) -> float | None:
        """Return the rate over the last seconds, None before two samples."""
        while self._counts and now_ns - self._counts[0][0] > WINDOW_S * NS_PER_S:
            self._counts.popleft()
        self._counts.append((now_ns, sequence))
        (first_ns, first), (last_ns, last) = self._counts[0], self._counts[-1]
        if last_ns == first_ns:
            return None
        return (last - first) * NS_PER_S / (last_ns - first_ns)


class TopicTable:
    """Publish the live topic "topics": rate and age of every topic, and what is declared."""

    topic = "topics"
    period_s = TABLE_PERIOD_S

    def __init__(self, space: SharedSpace, rings: Mapping[str, RingFeed]) -> None:
        """Take the feeds of event rings, which count what this process has lost of them."""
        self._rings = rings
        self._counted = [(topic, _Counted(space.pulse_reader(topic.name))) for topic in TOPICS]

    def begin(self) -> None:
        """Restart the measurement of rates, as nothing was counted without subscribers."""
        for _, counted in self._counted:
            counted.begin()

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return the whole table."""
        rows = [self._row(topic, counted, now) for topic, counted in self._counted]
        return (json_message(self.topic, now.run_ns, now, {"topics": rows}),)

    def _row(self, topic: Topic[Any], counted: _Counted, now: LookTime) -> dict[str, Any]:
        beat = counted.pulse.latest()
        rate_hz = None if beat is None else counted.rate_hz(now.run_ns, beat.sequence)
        ring = self._rings.get(topic.name)
        return {
            "topic": topic.name,
            "owner": topic.owner,
            "rate_hz": None if rate_hz is None else round(rate_hz, 2),
            "declared_hz": topic.rate_hz,
            "age_s": None if beat is None else round(beat.age_s(now.run_ns), 3),
            "deadline_s": topic.deadline_s,
            "lost": 0 if ring is None else ring.lost,
        }


class PathFeed:
    """Publish the live topic "path": the way driven and the way planned, in the map."""

    topic = "path"
    period_s = 0.5

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._clock = clock
        self._due_ns = 0
        self._pose = space.cell_reader(topics.POSE)
        self._executor = space.cell_reader(topics.EXECUTOR_STATUS)
        self._driven: deque[tuple[float, float]] = deque(maxlen=MOST_POINTS)
        self._sent: tuple[int, int, object] | None = None
        self._points = 0

    def step(self) -> None:
        """Follow the robot five times a second, also without subscribers."""
        now_ns = self._clock.now_ns()
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + _FOLLOW_NS
            self.follow()

    def stop(self) -> None:
        """Do nothing: the readers of shared memory are the link's."""

    def follow(self) -> None:
        """Append the robot's position once it has moved; a lost robot's pose means nothing."""
        sample = self._pose.latest()
        if sample is None or int(sample.data["state"]) == PlaceState.LOST:
            return
        here = (round(float(sample.data["x_m"]), 3), round(float(sample.data["y_m"]), 3))
        if not self._driven or math.dist(here, self._driven[-1]) >= STEP_M:
            self._driven.append(here)
            self._points += 1

    def begin(self) -> None:
        """Send both again."""
        self._sent = None

    def look(self, now: LookTime) -> Sequence[LiveMessage]:
        """Return both ways, if one has changed."""
        planned = self._planned(now)
        state = (self._points, len(planned), planned[-1:])
        if state == self._sent:
            return ()
        self._sent = state
        data = {"planned": planned, "driven": list(self._driven)}
        return (json_message(self.topic, now.run_ns, now, data),)

    def _planned(self, now: LookTime) -> list[list[float]]:
        sample = self._executor.latest()
        if sample is None or now.age_s(sample.stamp_ns) > _STALE_S:
            return []
        way: list[list[float]] = sample.document().get("way_m", [])
        return way
