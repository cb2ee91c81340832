"""`vla-deploy say`: give the robot a command in words, or a plan as JSON, and follow it."""

import argparse
import json
import select
import sys
from pathlib import Path
from typing import Any, Final, TextIO

from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.narrate import line_of
from vla_deploy.cli.session import Session, attach

EXIT_ASKED: Final = 3
EXAMPLES = """  vla-deploy say "go to the kitchen"
  vla-deploy say "pick up the red cup and put it in the box"
  vla-deploy say --plan plan.json --json
  vla-deploy say --answer "the red one"           to what the robot has asked

exit code 3: the robot asks something, and nobody is at the terminal to answer
"""


def register(commands: Any) -> None:
    """Add the command."""
    say = add_top_command(commands, "say", EXAMPLES)
    what = say.add_mutually_exclusive_group(required=True)
    what.add_argument("text", nargs="?", help="the command in words")
    what.add_argument("--plan", type=Path, help="a plan as JSON, in any of the known dialects")
    what.add_argument("--answer", metavar="WORDS", help="answer what the robot has asked")
    say.add_argument("--json", action="store_true", help="print the outcome as JSON")
    say.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Give the command; Ctrl-C cancels it."""
    session = attach(arguments.runtime_base)
    outcome = Follower(session, quiet=arguments.json).follow(_utterance(arguments))
    if arguments.json:
        print(json.dumps(outcome, indent=2))
    if outcome["event"] == "asked":
        return EXIT_ASKED
    if outcome["event"] == "rejected":
        raise UsageError(outcome["reason"])
    if not outcome["success"]:
        raise CommandFailed(outcome["error"] or "the command did not succeed")
    return 0


def _utterance(arguments: argparse.Namespace) -> dict[str, Any]:
    if arguments.plan:
        return {"plan": read_plan(arguments.plan)}
    if arguments.answer:
        return {"text": arguments.answer, "answer": True}
    return {"text": arguments.text}


class Follower:
    """Give a command, narrate its events, and pass on what the person answers at the terminal.

    Without a terminal, or where nothing but the outcome is to be printed, a question is the end.
    """

    def __init__(self, session: Session, quiet: bool, terminal: TextIO | None = None) -> None:
        self._session = session
        self._quiet = quiet
        self._terminal = sys.stdin if terminal is None else terminal
        self._is_asked = False

    def follow(self, utterance: dict[str, Any]) -> dict[str, Any]:
        """Return the last event, or the question that nobody here can answer."""
        last: dict[str, Any] = {}
        try:
            for event in self._session.command(self._pause, **utterance):
                last = event
                self._tell(event)
                self._is_asked = event["event"] == "asked"
                if self._is_asked and (self._quiet or not self._terminal.isatty()):
                    break
        except KeyboardInterrupt:
            self._session.cancel()
            raise
        return last

    def _tell(self, event: dict[str, Any]) -> None:
        line = line_of(event)
        if line and not self._quiet and event["event"] != "rejected":
            print(line, flush=True)

    def _pause(self) -> None:
        """Wait for a moment; what is typed meanwhile is the answer to what was asked."""
        self._session.pause()
        if self._is_asked and select.select([self._terminal], [], [], 0.0)[0]:
            self._is_asked = False
            typed = self._terminal.readline().strip()
            if typed:
                self._session.utter(text=typed, answer=True)


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
