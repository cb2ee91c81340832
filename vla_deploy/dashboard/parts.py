"""Make the parts of the dashboard that work between requests, stepped in the event loop."""

import time
from typing import Final, Protocol

from fastapi import FastAPI

from vla_deploy.client.command_history import CommandHistory
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.alarms.manager import AlarmFeed, AlarmFile, AlarmManager
from vla_deploy.dashboard.alarms.robot_status import StatusReader
from vla_deploy.dashboard.api.analysis import Analyst
from vla_deploy.dashboard.api.robot import StaticModel
from vla_deploy.dashboard.live.camera import CameraFeed, Detections
from vla_deploy.dashboard.live.feeds import PathFeed, RingFeed, TopicTable, topic_feeds
from vla_deploy.dashboard.live.hub import LiveHub
from vla_deploy.dashboard.live.microphone import PageMicrophones
from vla_deploy.dashboard.metering import Metering
from vla_deploy.robots import load_robot
from vla_deploy.runtime.state_dir import state_dir_of

_ALARM_FILE: Final = "dashboard/alarms.json"


class Part(Protocol):
    """Work a little many times a second, and never wait: all clients share the event loop."""

    def step(self) -> None:
        """Read the topics and do what is due."""
        ...

    def stop(self) -> None:
        """Release what the part holds."""
        ...


def make_parts(app: FastAPI) -> list[Part]:
    """Return the parts; what routes need of them is put into the app's state.

    Raises:
        RobotFileError: the robot's description has faults.
    """
    link: RobotLink = app.state.link
    model = StaticModel(load_robot(link.robot))
    camera = CameraFeed(link.space, Detections(link.space, model.robot, model.tree))
    path = PathFeed(link.space, link.clock)
    feeds = topic_feeds(link.space, model.robot.joint_names)
    rings = {feed.topic: feed for feed in feeds if isinstance(feed, RingFeed)}
    table = TopicTable(link.space, rings)
    alarms = AlarmManager(
        link.run_dir.resolve().name,
        StatusReader(link).read,
        AlarmFile(state_dir_of(link.base) / _ALARM_FILE),
        link.clock,
        time.time_ns,
    )
    hub = LiveHub([*feeds, camera, path, table, AlarmFeed(alarms)], link.clock, time.time_ns)
    commands = CommandHistory(link, time.time_ns)
    metering = Metering(link, lambda: hub.client_count, time.time_ns)
    state = app.state
    state.live, state.camera, state.static_model = hub, camera, model
    state.commands, state.alarms, state.metering = commands, alarms, metering
    state.microphones, state.analyst = PageMicrophones(link), Analyst(link)
    return [hub, path, commands, alarms, metering]
