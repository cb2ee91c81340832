"""Tell which way the robot has come and which it means to go, in the map."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Final

from vla_deploy.dashboard.live.message import Message, Moment, json_message
from vla_deploy.ipc import SharedSpace
from vla_deploy.navigation.localising.place_judge import PlaceState

MOST_POINTS: Final = 600
STEP_M: Final = 0.05
_STALE_S: Final = 1.0


class PathFeed:
    """Be the live topic "path"; `follow` is called in every step, looked at or not."""

    topic = "path"
    period_s = 0.5

    def __init__(self, space: SharedSpace) -> None:
        self._pose = space.cell_reader("pose")
        self._executor = space.cell_reader("executor_status")
        self._driven: deque[tuple[float, float]] = deque(maxlen=MOST_POINTS)
        self._told: tuple[int, int, object] | None = None
        self._points = 0

    def follow(self) -> None:
        """Remember where the robot is, once it has moved on; a lost robot's pose means nothing."""
        sample = self._pose.latest()
        if sample is None or int(sample.data["state"]) == PlaceState.LOST:
            return
        here = (round(float(sample.data["x_m"]), 3), round(float(sample.data["y_m"]), 3))
        if not self._driven or math.dist(here, self._driven[-1]) >= STEP_M:
            self._driven.append(here)
            self._points += 1

    def begin(self) -> None:
        """Tell both again."""
        self._told = None

    def look(self, now: Moment) -> Sequence[Message]:
        """Return both ways, where one has changed."""
        planned = self._planned(now)
        told = (self._points, len(planned), planned[-1:])
        if told == self._told:
            return ()
        self._told = told
        data = {"planned": planned, "driven": list(self._driven)}
        return (json_message(self.topic, now.run_ns, now, data),)

    def _planned(self, now: Moment) -> list[list[float]]:
        sample = self._executor.latest()
        if sample is None or now.age_s(sample.stamp_ns) > _STALE_S:
            return []
        way: list[list[float]] = sample.document().get("way_m", [])
        return way
