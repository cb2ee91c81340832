"""Run the planner process: `python -m vla_deploy.planning --run-dir D --robot butler`."""

import sys

from platforms import load_profile
from vla_deploy.aside import beside
from vla_deploy.node import NodeContext
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.node import PlannerNode
from vla_deploy.process_main import main
from vla_deploy.robots import load_robot


def build(context: NodeContext) -> PlannerNode:
    """Build the node from what the process was started with."""
    robot = load_robot(context.robot)
    profile = load_profile(context.profile)
    planner = planner_for(robot, profile, context.clock, context.run_dir.parent)
    return PlannerNode(context, robot, planner, beside("plan"))


if __name__ == "__main__":
    sys.exit(main("planner", build))
