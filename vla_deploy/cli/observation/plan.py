"""`vla-deploy plan`: show the plan for a command and the back end that made it; nothing moves."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.operation.say import EXIT_ASKED, read_json
from vla_deploy.cli.session import FRESH_S, RobotSession, attach, base_of
from vla_deploy.client.action_words import action_words
from vla_deploy.gateways.plan_preview import PlanPreview, preview, preview_request
from vla_deploy.ipc import topics
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.interfaces import Attempt, PlanRequest
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.world import Snapshot, read_snapshot
from vla_deploy.world.document import read_report

EXAMPLES: Final = """  vla-deploy plan "pick up the red cup and put it in the box"
  vla-deploy plan "bring me the bottle" --scene scene.json --json
  vla-deploy scene --json > scene.json            a scene to plan in later

exit code 3: the robot would ask back
"""


def register(commands: Any) -> None:
    """Add the command."""
    plan = add_top_command(
        commands, "plan", EXAMPLES, run, json_help="print plan and attempts as JSON"
    )
    plan.add_argument("text", help="the command in words")
    plan.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="plan in this scene (JSON) instead of what a running robot sees",
    )
    plan.add_argument("--robot", help="name or folder of a robot (default: the one that runs)")
    plan.add_argument("--profile", help="name or file of a profile (default: the one in force)")


def run(arguments: argparse.Namespace) -> int:
    """Plan the command and print the plan; exit code 2 where it is refused."""
    session = _session(arguments)
    table = session and session.document(topics.PROCESS_TABLE, FRESH_S)
    status = session and session.document(topics.PROFILE_STATUS, FRESH_S)
    robot = load_robot(arguments.robot or (table["robot"] if table else "butler"))
    profile = load_profile(arguments.profile or (status["profile"] if status else "desktop"))
    planner = planner_for(robot, profile, MonotonicClock(), base_of(arguments))
    found = preview(planner, _request(arguments, robot, session))
    emit(arguments, found.document(), lambda: as_text(found))
    if found.is_asked:
        return EXIT_ASKED
    if found.result.error is not None:
        raise found.result.error
    return 0


def as_text(found: PlanPreview) -> str:
    """Return a preview as lines for a person."""
    result = found.result
    lines = [_attempt_line(one) for one in result.attempts]
    lines += [f"{name} away: {why}" for name, why in found.away.items()]
    if result.plan is not None:
        lines += [
            f"  {one.id:<14} {action_words(one.skill, one.parameters)}"
            for one in result.plan.actions
        ]
    if found.question:
        lines.append(f"robot would ask: {found.question}")
    return "\n".join(lines)


def _attempt_line(attempt: Attempt) -> str:
    why = f": {attempt.reason}" if attempt.reason else ""
    return f"{attempt.back_end} {attempt.outcome} in {1000 * attempt.took_s:.1f} ms{why}"


def _session(arguments: argparse.Namespace) -> RobotSession | None:
    try:
        return attach(arguments.runtime_base)
    except UsageError:  # none runs, and none is needed
        return None


def _request(
    arguments: argparse.Namespace, robot: RobotDescription, session: RobotSession | None
) -> PlanRequest:
    request = preview_request(arguments.text, robot, session)
    if arguments.scene is None:
        return request
    return replace(request, scene=read_scene(arguments.scene))


def read_scene(path: Path) -> Snapshot:
    """Read a scene: the topic's document, or what `vla-deploy scene --json` prints.

    Raises:
        UsageError: it cannot be read, or is no JSON.
        SceneUnreadable: it is no scene.
    """
    return snapshot_of(read_json(path, "scene"))


def snapshot_of(document: Any) -> Snapshot:
    """Return the scene of either document.

    Raises:
        SceneUnreadable: it is no scene.
    """
    if isinstance(document, dict) and "things" in document:
        return read_report(document)
    return read_snapshot(document)
