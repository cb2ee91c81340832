"""Collect what all processes tell, for the rules to judge."""

from collections import deque
from collections.abc import Iterator
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.alarms.told import Document, Told, Word
from vla_deploy.ipc import TOPICS, Sample, TopicKind
from vla_deploy.navigation.localising.place_judge import Doubt, PlaceState

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
    }
)
_WINDOW_NS: Final = 5 * NS_PER_S
_CELLS: Final = tuple(
    topic.name for topic in TOPICS if topic.kind is TopicKind.CELL and topic.deadline_s
)


class Listener:
    """Look at every cell with a deadline, and count control's late ticks over a few seconds."""

    def __init__(self, link: RobotLink) -> None:
        self._link = link
        self._ticks: deque[tuple[int, int, int]] = deque()

    def listen(self) -> Told:
        """Return what is told now."""
        words = dict(self._words())
        status = words.get("control_status")
        ratio = None if status is None else self._late_ratio(status.document or {})
        return Told(words=words, late_ratio=ratio)

    def _words(self) -> Iterator[tuple[str, Word]]:
        now_ns = self._link.clock.now_ns()
        for name in _CELLS:
            sample = self._link.fresh(name)
            if sample is not None:
                yield name, Word(age_s=max(sample.age_s(now_ns), 0.0), document=_document(sample))

    def _late_ratio(self, status: Document) -> float | None:
        """Return the share of late ticks within the window, which a control that starts begins."""
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
    except ValueError:  # no JSON, of which the supervisor's watch tells
        return None
