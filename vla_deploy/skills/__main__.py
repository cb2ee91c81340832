"""Run the executor process: `python -m vla_deploy.skills --run-dir D --robot butler`."""

import sys

from platforms.profile import load_profile
from vla_deploy.devices import EXCHANGE_S, open_home, twin_broker_in
from vla_deploy.robots import load_robot
from vla_deploy.runtime.executors import worker_thread
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.process_main import main
from vla_deploy.skills.node import ExecutorNode


def build(context: NodeContext) -> ExecutorNode:
    """Build the node from what the process was started with."""
    profile = load_profile(context.profile)
    robot = load_robot(context.robot)
    devices = open_home(
        robot,
        context.clock,
        lambda name: worker_thread(f"device {name}", context.clock, EXCHANGE_S),
        twin_broker_in(context.devices_dir),
    )
    return ExecutorNode(
        context, robot, profile.executor_rate_hz, profile.planning.within_s, devices
    )


if __name__ == "__main__":
    sys.exit(main("executor", build))
