"""`vla-deploy robot`: write a robot's description for other tools, and suggest parts of it."""

import argparse
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vla_deploy.cli.commands import add_command, add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.manipulation.errors import PostureUnreachable
from vla_deploy.manipulation.reach_suggestion import suggested_reach
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.urdf import urdf_of

EXAMPLES = """  vla-deploy robot urdf --robot butler --out butler.urdf
  vla-deploy robot reach --robot my_arm
"""
URDF_EXAMPLES = """  vla-deploy robot urdf > butler.urdf
  vla-deploy robot urdf --robot my_folder --out my_robot.urdf
"""
REACH_EXAMPLES = """  vla-deploy robot reach --robot my_arm
  vla-deploy robot reach --robot so101 --json

Where hands that point straight down get to, by inverse kinematics: a table to begin with. Whether
an arm touches itself on its way is not looked at. vla-deploy check judges what you make of it.
"""


def register(commands: Any) -> None:
    """Add the command."""
    robot = add_top_command(commands, "robot", EXAMPLES)
    acts = robot.add_subparsers(dest="act", required=True, metavar="ACT")
    summary = "print the robot as URDF, for ROS, rviz and MoveIt"
    urdf = add_command(acts, "urdf", summary, URDF_EXAMPLES, write_urdf)
    urdf.add_argument("--robot", default="butler", help="name or folder of a robot")
    urdf.add_argument("--out", type=Path, metavar="FILE", help="write it there instead")
    summary = "print a [reach] table for the robot's arms"
    reach = add_command(
        acts, "reach", summary, REACH_EXAMPLES, print_reach, json_help="print the table as JSON"
    )
    reach.add_argument("--robot", default="butler", help="name or folder of a robot")


def write_urdf(arguments: argparse.Namespace) -> int:
    """Print the URDF, or write it to a file."""
    text = urdf_of(load_robot(arguments.robot))
    if arguments.out is None:
        sys.stdout.write(text)
    else:
        arguments.out.write_text(text, encoding="utf-8")
        print(f"{arguments.out}: written")
    return 0


def print_reach(arguments: argparse.Namespace) -> int:
    """Print where the hands get to, as a table of the robot file."""
    robot = load_robot(arguments.robot, despite=("reach",))
    if not robot.hands:
        raise UsageError(f"{robot.name} has no hands: expected [hands] in its file; see so101's")
    try:
        found = asdict(suggested_reach(robot))
    except PostureUnreachable as error:
        raise UsageError(str(error)) from error
    rows = (f"{key} = {_toml(value)}" for key, value in found.items())
    emit(arguments, found, "\n".join(["[reach]", *rows]))
    return 0


def _toml(value: float | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(float(value))
