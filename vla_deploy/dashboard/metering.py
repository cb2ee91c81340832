"""Read every metric once a second into the history, and at any time on request."""

import logging
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.client.link import RobotLink
from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.telemetry.errors import TrendsUnavailable
from vla_deploy.telemetry.metrics import READ_TOPICS, Readings, TopicSampler, read
from vla_deploy.telemetry.trends import SeriesMaker, TrendStore

PERIOD_NS: Final = NS_PER_S
TRENDS_DIR: Final = "trends"
_log = logging.getLogger(__name__)


class Metering:
    """Read all metrics and write their history; `why_not` says why none is kept."""

    def __init__(
        self, link: RobotLink, clients: Callable[[], int], wall_ns: Callable[[], int]
    ) -> None:
        self.store: TrendStore | None = None
        self.why_not = ""
        self._link = link
        self._clients = clients
        self._wall_ns = wall_ns
        self._sampler = TopicSampler(link.space, link.clock, READ_TOPICS, joint_names)
        self._series = SeriesMaker()
        self._due_ns = 0
        self._look_s = 0.0
        self._left_out = 0
        self._open(state_dir_of(link.base) / TRENDS_DIR, link.base / TRENDS_DIR)

    @property
    def wall_s(self) -> float:
        """Return the wall clock in seconds, which dates the history."""
        return self._wall_ns() / NS_PER_S

    def readings(self) -> Readings:
        """Return the current value of every metric."""
        begun_ns = self._link.clock.now_ns()
        own = {
            "version": version("vla-deploy"),
            "look_s": self._look_s,
            "left_out": self._left_out,
            "clients": self._clients(),
        }
        readings = read(self._sampler.snapshot(own))
        self._look_s = (self._link.clock.now_ns() - begun_ns) / NS_PER_S
        self._left_out = readings.left_out
        return readings

    def step(self) -> None:
        """Write the metrics into the history once a second."""
        now_ns = self._link.clock.now_ns()
        if self.store is None or now_ns < self._due_ns:
            return
        self._due_ns = now_ns + PERIOD_NS
        try:
            self.store.write(self.wall_s, self._series.values(self.readings()))
        except OSError as error:
            self._give_up(f"{error.strerror}: no place for a new series; make room on that disk")

    def stop(self) -> None:
        """Close the history's files."""
        if self.store is not None:
            self.store.close()
            self.store = None

    def _open(self, disk: Path, memory: Path) -> None:
        try:
            self.store = TrendStore(disk, memory)
        except TrendsUnavailable as error:
            self._give_up(str(error))

    def _give_up(self, why: str) -> None:
        _log.error("no history is kept: %s", why)
        self.stop()
        self.why_not = why


def joint_names(robot: str) -> tuple[str, ...]:
    """Return a robot's joints in the order of its file; none where it cannot be read."""
    try:
        return load_robot(robot).joint_names
    except RobotFileError as error:
        _log.warning("joints have no names in the metrics: %s", error)
        return ()
