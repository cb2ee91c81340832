"""Run the planner process: `python -m vla_deploy.planning --run-dir D --robot butler`."""

import sys

from vla_deploy.node import NodeContext
from vla_deploy.planning.node import PlannerNode
from vla_deploy.process_main import main
from vla_deploy.robots import load_robot


def build(context: NodeContext) -> PlannerNode:
    """Build the node from what the process was started with."""
    return PlannerNode(context, load_robot(context.robot))


if __name__ == "__main__":
    sys.exit(main("planner", build))
