"""`vla-deploy joint show | move | play`: where the joints are, and how they are moved."""

import argparse
import sys
from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.cli.commands import (
    add_command,
    add_top_command,
    emit,
    number_above_zero,
    number_within,
)
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation import joint_play
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.client.motions import Claimed, Motions, joint_view
from vla_deploy.client.readiness import SILENT, refusal_of
from vla_deploy.ipc import topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import JointLimits

USUAL_SPEED_RATIO: Final = 0.25
"""Of a joint's top speed: slow enough to follow with the eye."""
_FRESH_S: Final = 1.0
EXAMPLES: Final = """  vla-deploy joint show
  vla-deploy joint move head_pan --to 0.4
  vla-deploy joint move left_elbow --by -0.1 --speed 0.2
  vla-deploy joint play pick_cube --episode 3
"""


def register(commands: Any) -> None:
    """Add the command."""
    joint = add_top_command(commands, "joint", EXAMPLES)
    acts = joint.add_subparsers(dest="act", required=True, metavar="ACT")
    shown = add_command(
        acts,
        "show",
        "show position, setpoint, speed and effort of the joints",
        "  vla-deploy joint show\n  vla-deploy joint show left_elbow --json\n",
        show,
        json_help="print them as JSON",
    )
    shown.add_argument("names", nargs="*", metavar="NAME", help="only these joints")
    moved = add_command(
        acts,
        "move",
        "move one joint and wait until it is there; Ctrl-C ends the motion",
        "  vla-deploy joint move head_pan --to 0.4\n"
        "  vla-deploy joint move left_elbow --by -0.1 --speed 0.2\n",
        move,
        json_help="print how it ended as JSON",
    )
    moved.add_argument("name", metavar="NAME", help="see: vla-deploy joint show")
    finite = number_within(-sys.float_info.max, sys.float_info.max, "a finite number")
    goal = moved.add_mutually_exclusive_group(required=True)
    goal.add_argument("--to", type=finite, metavar="RAD", help="go there (a finger: metres)")
    goal.add_argument("--by", type=finite, metavar="RAD", help="go so far from where it is")
    moved.add_argument(
        "--speed",
        type=number_above_zero("a speed"),
        metavar="RAD_S",
        help=f"at most so fast (a finger: m/s; default: {USUAL_SPEED_RATIO:g} of its top speed)",
    )
    joint_play.register(acts)


def show(arguments: argparse.Namespace) -> int:
    """Print one line for each joint."""
    session = attach(arguments.runtime_base)
    robot = session.running_robot()
    names = arguments.names or list(robot.joint_names)
    limits = {name: _limits(robot, name) for name in names}
    rows = [
        row | {"min": limits[row["joint"]].min, "max": limits[row["joint"]].max}
        for row in _joints(session, robot, names)
    ]
    return emit(arguments, rows, _table(rows))


def _table(rows: Sequence[Mapping[str, Any]]) -> str:
    width = max(len(row["joint"]) for row in rows)
    lines = [f"{'':{width}}  position  setpoint   speed  effort  range"]
    lines += [
        f"{row['joint']:{width}}  {row['position']:8.3f}  {row['setpoint']:8.3f}"
        f"  {row['velocity']:6.2f}  {row['effort_ratio']:6.2f}"
        f"  {row['min']:.2f} to {row['max']:.2f}"
        for row in rows
    ]
    return "\n".join(lines)


def move(arguments: argparse.Namespace) -> int:
    """Move a joint as a plan does: claimed, limited and judged by control.

    Raises:
        UsageError: there is no such joint, or it cannot go there or so fast.
        CommandFailed: the robot is not armed, something else moves the joint, or the motion ended
            otherwise than at its goal.
    """
    session = attach(arguments.runtime_base)
    robot, name = session.running_robot(), arguments.name
    limits = _limits(robot, name)
    speed_ratio = _speed_ratio(name, limits, arguments.speed)
    (before,) = _joints(session, robot, [name])
    target = before["position"] + arguments.by if arguments.to is None else arguments.to
    if not limits.min <= target <= limits.max:
        raise UsageError(
            f"{name}: expected {limits.min:g} to {limits.max:g}, got {target:g}; "
            "see: vla-deploy joint show"
        )
    status, reason = _moved(session, robot, name, target, speed_ratio)
    (after,) = _joints(session, robot, [name])
    if status != "done":
        raise CommandFailed(f"{name} is at {after['position']:.3f}: {status}, {reason}")
    document = {"joint": name, "from": before["position"], "to": target, "at": after["position"]}
    return emit(arguments, document, f"{name}: {before['position']:.3f} -> {after['position']:.3f}")


def _moved(
    session: RobotSession, robot: RobotDescription, name: str, target: float, speed_ratio: float
) -> tuple[str, str]:
    """Move, and return how that ended and why."""
    claim = Claimed(session, "cli/joint", robot.groups_moving([name]))
    refusal = refusal_of(session.document(topics.CONTROL_STATUS, _FRESH_S)) or claim.why_not_taken()
    if refusal:
        raise CommandFailed(refusal)
    motions = Motions(session, robot.joint_index, "cli")
    try:
        motion_id = motions.go({name: target}, {}, speed_ratio)
        while (ended := motions.ended(motion_id)) is None:
            if session.document(topics.CONTROL_STATUS, _FRESH_S) is None:
                raise CommandFailed(SILENT)
            session.pause()
            motions.step()
    finally:
        motions.close()
        claim.release()
    return ended.status, ended.reason


def _joints(
    session: RobotSession, robot: RobotDescription, names: Sequence[str]
) -> list[dict[str, Any]]:
    view = joint_view(session, robot.joint_index, names)
    if view is None:
        raise CommandFailed(SILENT)
    return [
        {
            "joint": name,
            "position": round(float(view.position[row]), 4),
            "setpoint": round(float(view.setpoint[row]), 4),
            "velocity": round(float(view.velocity[row]), 4),
            "effort_ratio": round(float(view.effort_ratio[row]), 3),
        }
        for row, name in enumerate(names)
    ]


def _limits(robot: RobotDescription, name: str) -> JointLimits:
    if name not in robot.limits:
        raise UsageError(f"no joint {name}; there are {', '.join(robot.joint_names)}")
    return robot.limits[name]


def _speed_ratio(name: str, limits: JointLimits, speed: float | None) -> float:
    if speed is None:
        return USUAL_SPEED_RATIO
    if speed > limits.velocity:
        raise UsageError(f"--speed: expected at most {limits.velocity:g} for {name}, got {speed:g}")
    return speed / limits.velocity
