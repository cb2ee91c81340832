"""`vla-deploy check` and `vla-deploy schema`: check files without running anything."""

import argparse
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from platforms import load_profile
from vla_deploy.analysis.document import analysis_schema
from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.operation.say import read_json
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.planner import checked
from vla_deploy.plans.dialects import parse_plan
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import plan_schema
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.processes.ros_environment import require_environment

SCHEMAS: Final[Mapping[str, Callable[[], dict[str, Any]]]] = {
    "plan": plan_schema,
    "analysis": analysis_schema,
}


def register(commands: Any) -> None:
    """Add the commands."""
    check = add_top_command(
        commands,
        "check",
        "  vla-deploy check --robot butler\n  vla-deploy check --plan plan.json\n",
        run,
    )
    check.add_argument("--robot", default="butler", help="name or folder of a robot")
    check.add_argument("--profile", default="desktop", help="name or file of a profile")
    check.add_argument("--plan", type=Path, help="a plan to check against the robot")
    schema = add_top_command(
        commands, "schema", "  vla-deploy schema\n  vla-deploy schema analysis\n", run_schema
    )
    schema.add_argument("what", nargs="?", choices=tuple(SCHEMAS), default="plan", help="of what")


def run(arguments: argparse.Namespace) -> int:
    """Check robot, profile and plan; a fault ends in one message and exit code 2."""
    robot = load_robot(arguments.robot)
    profile = load_profile(arguments.profile)
    require_environment(robot)
    print(f"robot {robot.name}: {len(robot.joint_names)} servos, {len(robot.places)} places: ok")
    print(f"profile {profile.name}: ok")
    if arguments.plan:
        request = PlanRequest(command_id="", text="", world=world_of(robot, {}))
        plan = checked(parse_plan(read_json(arguments.plan, "plan")), request)
        print(f"plan {arguments.plan}: {len(plan.actions)} actions: ok")
    return 0


def run_schema(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    print(json.dumps(SCHEMAS[arguments.what](), indent=2))
    return 0
