"""Read the status of all processes at one moment, as the input of the alarm rules."""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.client.place_state import Doubt, PlaceState
from vla_deploy.ipc import BY_NAME, TOPICS, Sample, TopicKind

Document = Mapping[str, Any]
DOCUMENTS: Final = frozenset(
    {
        "process_table",
        "control_status",
        "budget",
        "resource_directives",
        "scene",
        "speech_status",
        "planner_status",
        "stop_door_status",
        "twin_status",
        "battery",
    }
)
_WINDOW_NS: Final = 5 * NS_PER_S
_CELLS: Final = tuple(
    topic.name for topic in TOPICS if topic.kind is TopicKind.CELL and topic.deadline_s
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicStatus:
    """Hold age and document of a cell's newest value; of packed cells "pose" alone has one.

    That one is `{"state", "doubt", "match_ratio"}`, with the names of the first two.
    """

    age_s: float
    document: Document | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotStatus:
    """Hold the newest value of each topic; topics that were never published are missing.

    `late_ratio` is the share of late ticks of control over the last seconds, None before there are
    enough ticks.
    """

    topics: Mapping[str, TopicStatus] = field(default_factory=dict)
    late_ratio: float | None = None

    def age_s(self, topic: str) -> float | None:
        """Return the age of a topic's newest value."""
        topic_status = self.topics.get(topic)
        return None if topic_status is None else topic_status.age_s

    def document(self, topic: str) -> Document | None:
        """Return the newest document of a topic, None where it is beyond its deadline."""
        topic_status = self.topics.get(topic)
        if topic_status is None or topic_status.age_s > BY_NAME[topic].deadline_s:
            return None
        return topic_status.document

    def is_ready(self, process: str) -> bool:
        """Return whether the supervisor reports a process as ready."""
        table = self.document("process_table")
        rows = table["processes"] if table is not None else ()
        return any(row["name"] == process and row["state"] == "ready" for row in rows)


class StatusReader:
    """Read every cell with a deadline, and count control's late ticks over a few seconds."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._ticks: deque[tuple[int, int, int]] = deque()

    def read(self) -> RobotStatus:
        """Return the status of now."""
        topics = dict(self._topics())
        status = topics.get("control_status")
        ratio = None if status is None else self._late_ratio(status.document or {})
        return RobotStatus(topics=topics, late_ratio=ratio)

    def _topics(self) -> Iterator[tuple[str, TopicStatus]]:
        now_ns = self._link.clock.now_ns()
        for name in _CELLS:
            sample = self._link.fresh(name)
            if sample is not None:
                yield (
                    name,
                    TopicStatus(age_s=max(sample.age_s(now_ns), 0.0), document=_document(sample)),
                )

    def _late_ratio(self, status: Document) -> float | None:
        """Return the share of late ticks within the window, which a restart of control resets."""
        now_ns, ticks = self._link.clock.now_ns(), self._ticks
        tick, late = int(status.get("tick", 0)), int(status.get("late_ticks", 0))
        if ticks and tick < ticks[-1][1]:
            ticks.clear()
        ticks.append((now_ns, tick, late))
        while len(ticks) > 1 and now_ns - ticks[1][0] >= _WINDOW_NS:
            ticks.popleft()
        first_ns, first_tick, first_late = ticks[0]
        if now_ns - first_ns < _WINDOW_NS or tick == first_tick:
            return None
        return (late - first_late) / (tick - first_tick)


def _document(sample: Sample) -> Document | None:
    if sample.topic == "pose":
        data = sample.data
        return {
            "state": PlaceState(int(data["state"])).name.lower(),
            "doubt": Doubt(int(data["doubt"])).name.lower(),
            "match_ratio": round(float(data["match_ratio"]), 3),
        }
    try:
        return sample.document() if sample.topic in DOCUMENTS else None
    except ValueError:  # no JSON, which the supervisor reports
        return None
