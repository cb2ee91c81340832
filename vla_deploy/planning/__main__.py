"""Run the planner process: `python -m vla_deploy.planning --run-dir D --robot butler`."""

import sys
from typing import Final

from platforms import load_profile
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.memory.meaning import installed_embedder
from vla_deploy.missions.store import FILE_NAME, MissionStore
from vla_deploy.planning.assembly import open_memory, planner_for
from vla_deploy.planning.node import PlannerNode
from vla_deploy.planning.prohibitions import Prohibitions
from vla_deploy.robots import load_robot
from vla_deploy.runtime.executors import low_priority_thread, worker_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main
from vla_deploy.runtime.state_dir import state_dir_of

PLANNING_S: Final = 0.2
"""What a plan of the parser on board takes, of simulated time."""


def build(context: NodeContext) -> PlannerNode:
    """Build the node from what the process was started with."""
    robot = load_robot(context.robot)
    profile, base = load_profile(context.profile), context.run_dir.parent
    planner = planner_for(robot, profile, context.clock, base, run_dir=context.run_dir)
    shelf = ModelShelf.of_run(context.run_dir, context.clock)
    remembers = profile.planning.remembered > 0
    embedder = installed_embedder(shelf, profile) if remembers else None
    memory = open_memory(profile.planning, base, embedder)
    executor = worker_thread("plan", context.clock, PLANNING_S)
    missions = MissionStore(state_dir_of(base) / FILE_NAME)
    forbidden = Prohibitions.of_base(base)
    audit = AuditLog.of_base(base, context.clock, low_priority_thread(context.clock))
    return PlannerNode(context, robot, planner, executor, memory, forbidden, missions, audit=audit)


if __name__ == "__main__":
    sys.exit(main("planner", build, mendable=(InferenceError,)))
