"""`vla-deploy mission`: give a mission of several objectives, see how far it is, cancel it."""

import argparse
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.commands import Run, add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.say import Follower, read_json
from vla_deploy.cli.session import attach
from vla_deploy.ipc import topics

EXAMPLES: Final[Mapping[str, str]] = {
    "run": "  vla-deploy mission run mission.json\n",
    "list": "  vla-deploy mission list\n",
    "cancel": "  vla-deploy mission cancel cli-4711-1\n",
}
_WORDS: Final = (
    '  vla-deploy say "go to the kitchen; find the cup and bring it; clean the table"\n'
    '  vla-deploy say "every ten minutes, go to the kitchen"\n'
)
_SIGNS: Final[Mapping[str, str]] = {
    "pending": "·", "executing": "…", "checking": "…", "completed": "✓", "failed": "✗",
    "cancelled": "-",
}  # fmt: skip


def register(commands: Any) -> None:
    """Add the command."""
    mission = add_top_command(commands, "mission", "".join(EXAMPLES.values()) + _WORDS)
    acts = mission.add_subparsers(required=True)
    given = _act(acts, "run", "give a mission and follow it to its end", run)
    given.add_argument("file", type=Path, help="the mission as JSON: see docs/missions.md")
    _act(acts, "list", "the newest missions, and how far each is", list_missions)
    cancelled = _act(acts, "cancel", "end a mission, or one that waits for its time", cancel)
    cancelled.add_argument("mission", help="its id in the list")


def _act(acts: Any, name: str, summary: str, run: Run) -> argparse.ArgumentParser:
    return add_command(acts, name, summary, EXAMPLES[name], run, "print JSON")


def run(arguments: argparse.Namespace) -> int:
    """Give a mission; Ctrl-C cancels it.

    Raises:
        UsageError: the file is no mission, or one with faults; all are named.
        CommandFailed: an objective was not reached.
    """
    document = read_json(arguments.file, "mission")
    session = attach(arguments.runtime_base)
    outcome = Follower(session, quiet=arguments.json).follow({"mission": document})
    if arguments.json:
        print(json.dumps(outcome, indent=2))
    if outcome["event"] == "rejected":
        raise UsageError(outcome["reason"])
    if not outcome["success"]:
        raise CommandFailed(outcome["error"] or "the mission did not succeed")
    return 0


def list_missions(arguments: argparse.Namespace) -> int:
    """Print the newest missions, the newest first."""
    session = attach(arguments.runtime_base)
    document = session.document(topics.MISSIONS)
    if document is None:
        raise CommandFailed("the planner does not answer; see: vla-deploy status")
    lines = [line for one in document["missions"] for line in _lines_of(one)]
    if document["trouble"]:
        lines.append(f"missions do not outlive a restart: {document['trouble']}")
    return emit(arguments, document, "\n".join(lines) or "no mission was given yet")


def cancel(arguments: argparse.Namespace) -> int:
    """End one mission; what it moves comes to rest.

    Raises:
        CommandFailed: there is no such mission that has not ended.
    """
    session = attach(arguments.runtime_base)
    *_, last = session.command(mission_act={"cancel": arguments.mission})
    if last["event"] != "finished" or not last["success"]:
        raise CommandFailed(last.get("error") or last.get("reason") or "no answer")
    return emit(arguments, last, f"{arguments.mission} is cancelled")


def _lines_of(mission: Mapping[str, Any]) -> list[str]:
    goal, due_s = mission["mission"]["goal"], mission["due_unix_s"]
    when = ""
    if due_s is not None and mission["state"] == "planning":
        when = f", begins at {datetime.fromtimestamp(due_s, UTC).astimezone():%a %H:%M}"
    lines = [f"{mission['mission_id']}  {mission['state']}{when}: {goal}"]
    for objective in mission["mission"]["objectives"]:
        run = mission["objectives"].get(objective["id"], {"state": "pending"})
        told = "; ".join(run[key] for key in ("error", "note") if run.get(key))
        words = objective["words"] or objective["id"]
        lines.append(f"    {_SIGNS[run['state']]} {words}" + (f"  ({told})" if told else ""))
    return lines
