"""Tell how every topic beats: its rate, its age, against what is declared."""

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.dashboard.live.message import Message, Moment, json_message
from vla_deploy.dashboard.live.topic_feeds import RingFeed
from vla_deploy.ipc import TOPICS, PulseReader, SharedSpace, Topic

PERIOD_S: Final = 0.5
WINDOW_S: Final = 4.0
"""Rates are those of so long a time: whole values are counted, and tables come twice a second."""


class _Counted:
    """Follow the sequence of one topic."""

    def __init__(self, pulse: PulseReader) -> None:
        self.pulse = pulse
        self._counts: deque[tuple[int, int]] = deque()

    def begin(self) -> None:
        self._counts.clear()

    def rate_hz(self, now_ns: int, sequence: int) -> float | None:
        """Return the rate of the last seconds, None before there is one."""
        while self._counts and now_ns - self._counts[0][0] > WINDOW_S * NS_PER_S:
            self._counts.popleft()
        self._counts.append((now_ns, sequence))
        (first_ns, first), (last_ns, last) = self._counts[0], self._counts[-1]
        if last_ns == first_ns:
            return None
        return (last - first) * NS_PER_S / (last_ns - first_ns)


class TopicTable:
    """Be the live topic "topics"."""

    topic = "topics"
    period_s = PERIOD_S

    def __init__(self, space: SharedSpace, rings: Mapping[str, RingFeed]) -> None:
        """Take the feeds of event rings, which know what this process has lost of them."""
        self._rings = rings
        self._counted = [(topic, _Counted(space.pulse_reader(topic.name))) for topic in TOPICS]

    def begin(self) -> None:
        """Measure rates anew: what passed meanwhile was not looked at."""
        for _, counted in self._counted:
            counted.begin()

    def look(self, now: Moment) -> Sequence[Message]:
        """Return the whole table."""
        rows = [self._row(topic, counted, now) for topic, counted in self._counted]
        return (json_message(self.topic, now.run_ns, now, {"topics": rows}),)

    def _row(self, topic: Topic, counted: _Counted, now: Moment) -> dict[str, Any]:
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
