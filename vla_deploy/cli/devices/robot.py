"""`vla-deploy robot`: write a robot's description in the format of another tool."""

import argparse
import sys
from pathlib import Path
from typing import Any

from vla_deploy.cli.commands import add_command, add_top_command
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.urdf import urdf_of

EXAMPLES = "  vla-deploy robot urdf --robot butler --out butler.urdf\n"
URDF_EXAMPLES = """  vla-deploy robot urdf > butler.urdf
  vla-deploy robot urdf --robot my_folder --out my_robot.urdf
"""


def register(commands: Any) -> None:
    """Add the command."""
    robot = add_top_command(commands, "robot", EXAMPLES)
    acts = robot.add_subparsers(dest="act", required=True, metavar="ACT")
    summary = "print the robot as URDF, for ROS, rviz and MoveIt"
    urdf = add_command(acts, "urdf", summary, URDF_EXAMPLES, write_urdf)
    urdf.add_argument("--robot", default="butler", help="name or folder of a robot")
    urdf.add_argument("--out", type=Path, metavar="FILE", help="write it there instead")


def write_urdf(arguments: argparse.Namespace) -> int:
    """Print the URDF, or write it to a file."""
    text = urdf_of(load_robot(arguments.robot))
    if arguments.out is None:
        sys.stdout.write(text)
    else:
        arguments.out.write_text(text, encoding="utf-8")
        print(f"{arguments.out}: written")
    return 0
