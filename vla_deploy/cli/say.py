"""`vla-deploy say`: give the robot a command in words, or a plan as JSON, and follow it."""

import argparse
import json
from pathlib import Path
from typing import Any

from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.narrate import line_of
from vla_deploy.cli.session import Session, attach

EXAMPLES = """  vla-deploy say "go to the kitchen"
  vla-deploy say "pick up the red cup and put it in the box"
  vla-deploy say --plan plan.json --json
"""


def register(commands: Any) -> None:
    """Add the command."""
    say = add_top_command(commands, "say", EXAMPLES)
    what = say.add_mutually_exclusive_group(required=True)
    what.add_argument("text", nargs="?", help="the command in words")
    what.add_argument("--plan", type=Path, help="a plan as JSON, in any of the known dialects")
    say.add_argument("--json", action="store_true", help="print the outcome as JSON")
    say.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Give the command; Ctrl-C cancels it."""
    utterance: dict[str, Any] = {"text": arguments.text}
    if arguments.plan:
        utterance = {"plan": read_plan(arguments.plan)}
    session = attach(arguments.runtime_base)
    outcome = follow(session, utterance, quiet=arguments.json)
    if arguments.json:
        print(json.dumps(outcome, indent=2))
    if outcome["event"] == "rejected":
        raise UsageError(outcome["reason"])
    if not outcome["success"]:
        raise CommandFailed(outcome["error"] or "the command did not succeed")
    return 0


def follow(session: Session, utterance: dict[str, Any], quiet: bool) -> dict[str, Any]:
    """Give a command, narrate its events, return the last one."""
    last: dict[str, Any] = {}
    try:
        for event in session.command(**utterance):
            last = event
            line = line_of(event)
            if line and not quiet and event["event"] != "rejected":
                print(line, flush=True)
    except KeyboardInterrupt:
        session.cancel()
        raise
    return last


def read_plan(path: Path) -> Any:
    """Read a plan file.

    Raises:
        UsageError: it cannot be read or is no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read the plan {path}: {error.strerror}") from error
    except ValueError as error:
        raise UsageError(f"the plan {path} is no JSON: {error}") from error
