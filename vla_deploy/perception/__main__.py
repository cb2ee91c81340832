"""Run the perception process: `python -m vla_deploy.perception --run-dir D --robot butler`."""

import os
import sys
from typing import Final

from drivers.opener import PathOpener
from drivers.recording.opener import RECORD_VARIABLE, recorded_if_asked
from platforms import load_profile
from vla_deploy.inference.errors import InferenceError
from vla_deploy.perception.node import PerceptionNode
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.runtime.executors import worker_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main

DETECTION_S: Final = 0.1
"""Simulated time that the detector takes for an image."""


def build(context: NodeContext) -> PerceptionNode:
    """Build the node from what the process was started with."""
    robot = load_robot(context.robot)
    links = device_links(robot, context.devices_dir)
    opener = recorded_if_asked(
        PathOpener(links, context.clock), context.clock, os.environ.get(RECORD_VARIABLE)
    )
    profile = load_profile(context.profile)
    return PerceptionNode(
        context, robot, profile, opener, worker_thread("network", context.clock, DETECTION_S)
    )


if __name__ == "__main__":
    sys.exit(main("perception", build, mendable=(InferenceError,)))
