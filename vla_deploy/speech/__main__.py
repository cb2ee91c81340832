"""Run the speech process: `python -m vla_deploy.speech --run-dir D --robot butler`."""

import sys

from platforms import load_profile
from vla_deploy.node import NodeContext
from vla_deploy.process_main import main
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.speech.devices import linked_microphone
from vla_deploy.speech.node import SpeechNode


def build(context: NodeContext) -> SpeechNode:
    """Build the node from what the process was started with."""
    robot = load_robot(context.robot)
    links = device_links(robot, context.devices_dir)
    profile = load_profile(context.profile)
    return SpeechNode(context, robot, profile, linked_microphone(robot, links, context.clock))


if __name__ == "__main__":
    sys.exit(main("speech", build))
