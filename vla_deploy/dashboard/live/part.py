"""Make the hub of the live topics of one robot."""

import time

from fastapi import FastAPI

from vla_deploy.dashboard.link import RobotLink
from vla_deploy.dashboard.live.hub import LiveHub
from vla_deploy.dashboard.live.topic_feeds import topic_feeds
from vla_deploy.robots import load_robot


def live_hub(app: FastAPI) -> LiveHub:
    """Return the hub, which routes and other parts find as `app.state.live`.

    Raises:
        RobotFileError: the robot's description has faults.
    """
    link: RobotLink = app.state.link
    robot = load_robot(link.robot)
    hub = LiveHub(topic_feeds(link.space, robot.joint_names), link.clock, time.time_ns)
    app.state.live = hub
    return hub
