"""Make the hub of the live topics of one robot, and step what belongs to it."""

import time
from typing import Final

from fastapi import FastAPI

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.live.camera import CameraFeed
from vla_deploy.dashboard.live.detections import Detections
from vla_deploy.dashboard.live.hub import LiveHub
from vla_deploy.dashboard.live.microphone import PageMicrophones
from vla_deploy.dashboard.live.path_feed import PathFeed
from vla_deploy.dashboard.live.still import Still
from vla_deploy.dashboard.live.topic_feeds import RingFeed, topic_feeds
from vla_deploy.dashboard.live.topic_table import TopicTable
from vla_deploy.robots import load_robot

_FOLLOW_NS: Final = NS_PER_S // 5


class Live:
    """Step the hub, and follow the robot's way also while nobody looks."""

    def __init__(self, hub: LiveHub, path: PathFeed, clock: Clock) -> None:
        self._hub = hub
        self._path = path
        self._clock = clock
        self._due_ns = 0

    def step(self) -> None:
        """Tell clients what is new."""
        self._hub.step()
        now_ns = self._clock.now_ns()
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + _FOLLOW_NS
            self._path.follow()

    def stop(self) -> None:
        """Let every client go."""
        self._hub.stop()


def live(app: FastAPI) -> Live:
    """Return the part; what routes and other parts need of it lies in the app's state.

    Raises:
        RobotFileError: the robot's description has faults.
    """
    link: RobotLink = app.state.link
    still = Still(load_robot(link.robot))
    camera = CameraFeed(link.space, Detections(link.space, still.robot, still.tree))
    path = PathFeed(link.space)
    feeds = topic_feeds(link.space, still.robot.joint_names)
    rings = {feed.topic: feed for feed in feeds if isinstance(feed, RingFeed)}
    table = TopicTable(link.space, rings)
    hub = LiveHub([*feeds, camera, path, table], link.clock, time.time_ns)
    app.state.live, app.state.camera, app.state.still = hub, camera, still
    app.state.microphones = PageMicrophones(link)
    return Live(hub, path, link.clock)
