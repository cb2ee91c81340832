"""`vla-deploy plan`: what would be done for a command, and who planned it; nothing moves."""

import argparse
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.say import EXIT_ASKED
from vla_deploy.cli.session import Session, attach
from vla_deploy.client.action_words import action_words
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.dialogue.command import UserCommand
from vla_deploy.planning.dialogue.confirmation import confirmation_of
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.planning.errors import Ambiguous
from vla_deploy.planning.interfaces import Attempt, PlanningResult, PlanRequest
from vla_deploy.planning.knowledge import world_of
from vla_deploy.planning.understanding import Conversation
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.supervisor.runs.runtime import default_base
from vla_deploy.world import Snapshot, read_snapshot
from vla_deploy.world.report import read_report

EXAMPLES: Final = """  vla-deploy plan "pick up the red cup and put it in the box"
  vla-deploy plan "bring me the bottle" --scene scene.json --json
  vla-deploy scene --json > scene.json            a scene to plan in later

exit code 3: the robot would ask back
"""
_FRESH_S: Final = 5.0


def register(commands: Any) -> None:
    """Add the command."""
    plan = add_top_command(commands, "plan", EXAMPLES)
    plan.add_argument("text", help="the command in words")
    plan.add_argument(
        "--scene",
        type=Path,
        metavar="FILE",
        help="plan in this scene (JSON) instead of what a running robot sees",
    )
    plan.add_argument("--robot", help="name or folder of a robot (default: the one that runs)")
    plan.add_argument("--profile", help="name or file of a profile (default: the one in force)")
    plan.add_argument("--json", action="store_true", help="print plan and attempts as JSON")
    plan.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Plan the command and print the plan; refused is exit code 2."""
    base: Path = arguments.runtime_base or default_base()
    robot = load_robot(arguments.robot or _told(arguments, "process_table").get("robot", "butler"))
    in_force = _told(arguments, "profile_status").get("profile", "desktop")
    profile = load_profile(arguments.profile or in_force)
    clock = MonotonicClock()
    planner = planner_for(robot, profile, clock, base)
    request = _request(arguments, robot)
    answer, away = planner.plan(request), planner.away
    asks = confirmation_of(answer.plan, request, answer.proposal) if answer.plan else ""
    document = told(answer, asks, away)
    print(json.dumps(document, indent=2) if arguments.json else as_text(answer, asks, away))
    if isinstance(answer.error, Ambiguous):
        return EXIT_ASKED
    if answer.error is not None:
        raise answer.error
    return 0


def told(answer: PlanningResult, asks: str, away: Mapping[str, str]) -> dict[str, Any]:
    """Return an answer as scripts read it, what is asked first, and who is away, by why."""
    proposal = answer.proposal
    is_asked = isinstance(answer.error, Ambiguous)
    return {
        "plan": None if answer.plan is None else answer.plan.model_dump(mode="json"),
        "rung": None if proposal is None else proposal.back_end,
        "confidence": None if proposal is None else round(proposal.confidence, 3),
        "read_back": asks or None,
        "question": str(answer.error) if is_asked else None,
        "refused": None if answer.error is None or is_asked else str(answer.error),
        "attempts": [one.document() for one in answer.attempts],
        "away": dict(away),
    }


def as_text(answer: PlanningResult, asks: str, away: Mapping[str, str]) -> str:
    """Return an answer as lines for a person, what is asked first, and who is away."""
    lines = [_attempt_line(one) for one in answer.attempts]
    lines += [f"{name} away: {why}" for name, why in away.items()]
    if answer.plan is not None:
        lines += [
            f"  {one.id:<14} {action_words(one.skill, one.parameters)}"
            for one in answer.plan.actions
        ]
    question = answer.error if isinstance(answer.error, Ambiguous) else asks
    if question:
        lines.append(f"robot would ask: {question}")
    return "\n".join(lines)


def _attempt_line(attempt: Attempt) -> str:
    why = f": {attempt.reason}" if attempt.reason else ""
    return f"{attempt.back_end} {attempt.outcome} in {1000 * attempt.took_s:.1f} ms{why}"


def _told(arguments: argparse.Namespace, topic: str) -> Mapping[str, Any]:
    session = _session(arguments)
    return {} if session is None else session.document(topic, _FRESH_S) or {}


def _session(arguments: argparse.Namespace) -> Session | None:
    try:
        return attach(arguments.runtime_base)
    except UsageError:  # none runs: then nothing is known, which is no mistake
        return None


def _request(arguments: argparse.Namespace, robot: RobotDescription) -> PlanRequest:
    command = UserCommand(command_id="plan", told_ns=0, text=arguments.text)
    session = _session(arguments)
    if session is None:
        request = PlanRequest(command_id="plan", text=command.text, world=world_of(robot, {}))
    else:
        situation = Situation(session.space, session.clock, robot)
        request = situation.request(command, Conversation())
    if arguments.scene is None:
        return request
    return replace(request, scene=read_scene(arguments.scene))


def read_scene(path: Path) -> Snapshot:
    """Read a scene: the topic's document, or what `vla-deploy scene --json` prints.

    Raises:
        UsageError: it cannot be read, or is no JSON.
        SceneUnreadable: it is no scene.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read the scene {path}: {error.strerror}") from error
    except ValueError as error:
        raise UsageError(f"the scene {path} is no JSON: {error}") from error
    if isinstance(document, dict) and "things" in document:
        return read_report(document)
    return read_snapshot(document)
