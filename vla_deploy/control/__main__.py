"""Run the control process: `python -m vla_deploy.control --run-dir D --robot butler`."""

import gc
import os
import sys

from drivers.opener import PathOpener
from drivers.recording.opener import RECORD_VARIABLE, recorded_if_asked
from platforms import load_profile
from vla_deploy.control.node import ControlNode
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main


def build(context: NodeContext) -> ControlNode:
    """Build the node, and keep the collector away from everything that was built with it."""
    robot = load_robot(context.robot)
    links = device_links(robot, context.devices_dir)
    devices = recorded_if_asked(
        PathOpener(links, context.clock), context.clock, os.environ.get(RECORD_VARIABLE)
    )
    node = ControlNode(context, robot, load_profile(context.profile), devices)
    gc.collect()
    gc.freeze()
    return node


if __name__ == "__main__":
    sys.exit(main("control", build))
