"""`vla-deploy check` and `vla-deploy schema`: check files without running anything."""

import argparse
import json
from collections.abc import Callable, Mapping, Sized
from pathlib import Path
from typing import Any, Final

from platforms import load_profile
from vla_deploy.analysis.document import analysis_schema
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.maintenance.plan_check import PlanCheck, check_plan_file
from vla_deploy.cli.maintenance.robot_check import require_usable
from vla_deploy.control.modes.retuning import require_bus_rate
from vla_deploy.navigation.path_planning import base_planner
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import plan_schema
from vla_deploy.robots import load_robot
from vla_deploy.robots.servos.guard import GUARD_PAGE, GUARD_REMEDY, unguarded_servos
from vla_deploy.supervisor.processes.ros_environment import require_environment

EXAMPLES: Final = """  vla-deploy check --robot butler
  vla-deploy check --plan plan.json               what each action becomes, and what is not used
  vla-deploy check --plan plan.json --scene scene.json --json

A scene is what vla-deploy scene --json prints, or an object with object_locations, robot_position
and map_bounds.
"""
SCHEMAS: Final[Mapping[str, Callable[[], dict[str, Any]]]] = {
    "plan": plan_schema,
    "analysis": analysis_schema,
}


def register(commands: Any) -> None:
    """Add the commands."""
    check = add_top_command(
        commands,
        "check",
        EXAMPLES,
        run,
        json_help="print what was checked as JSON, with all faults of a plan",
    )
    check.add_argument("--robot", default="butler", help="name or folder of a robot")
    check.add_argument("--profile", default="desktop", help="name or file of a profile")
    check.add_argument("--plan", type=Path, help="a plan to check against the robot")
    check.add_argument(
        "--scene", type=Path, metavar="FILE", help="check the plan in this scene (JSON)"
    )
    schema = add_top_command(
        commands, "schema", "  vla-deploy schema\n  vla-deploy schema analysis\n", run_schema
    )
    schema.add_argument("what", nargs="?", choices=tuple(SCHEMAS), default="plan", help="of what")


def run(arguments: argparse.Namespace) -> int:
    """Check robot, profile and plan; a fault ends in one message and exit code 2."""
    if arguments.scene and not arguments.plan:
        raise UsageError("--scene is where a plan is checked: add --plan FILE")
    robot = load_robot(arguments.robot)
    profile = load_profile(arguments.profile)
    require_environment(robot)
    require_usable(robot, arguments.robot)
    require_bus_rate(robot, profile)
    lines = [
        f"robot {robot.name}: {_count(robot.joint_names, 'servo')}, "
        f"{_count(robot.places, 'place')}: ok",
        f"profile {profile.name}: ok",
    ]
    document: dict[str, Any] = {"robot": robot.name, "profile": profile.name}
    if lacks := unguarded_servos(robot):
        document["notes"] = [lacks]
        lines.append(f"note: {lacks}; {GUARD_REMEDY}: {GUARD_PAGE}")
    found = PlanCheck()
    if arguments.plan:
        world = world_of(robot, {}, base_planner(robot).is_free)
        found = check_plan_file(arguments.plan, arguments.scene, world)
        document |= found.document()
    if found.plan is not None:
        lines += [f"plan {arguments.plan}: {len(found.plan.actions)} actions: ok", *found.lines()]
    emit(arguments, document, "\n".join(lines))
    if found.error is not None:
        raise found.error
    return 0


def run_schema(arguments: argparse.Namespace) -> int:
    """Print the schema."""
    print(json.dumps(SCHEMAS[arguments.what](), indent=2))
    return 0


def _count(things: Sized, name: str) -> str:
    return f"{len(things)} {name}{'' if len(things) == 1 else 's'}"
