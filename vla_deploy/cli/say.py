"""`vla-deploy say`: give the robot a command in words, or a plan as JSON, and follow it."""

import argparse
import json
import select
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, TextIO

from vla_deploy.cli.aloud import STOP, USUAL_VOICE, Aloud
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.narrate import line_of
from vla_deploy.cli.session import Session, attach

EXIT_ASKED: Final = 3
EXAMPLES = """  vla-deploy say "go to the kitchen"
  vla-deploy say "pick up the red cup and put it in the box"
  vla-deploy say --plan plan.json --json
  vla-deploy say --aloud "go to the kitchen" --voice en-us+f4 --snr 10
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
    say.add_argument(
        "--aloud", action="store_true", help="let a synthetic person say it in the twin's room"
    )
    say.add_argument("--voice", help=f"whose voice, of eSpeak NG (default: {USUAL_VOICE})")
    say.add_argument("--snr", type=float, metavar="DB", help="over noise, this much louder")
    say.add_argument("--json", action="store_true", help="print the outcome as JSON")
    say.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Give the command; Ctrl-C cancels it."""
    _check_aloud(arguments)
    utterance = _utterance(arguments)
    session = attach(arguments.runtime_base)
    follower = Follower(session, quiet=arguments.json)
    if arguments.aloud:
        outcome = follow_aloud(session, follower, arguments)
    else:
        outcome = follower.follow(utterance)
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


def _check_aloud(arguments: argparse.Namespace) -> None:
    if arguments.aloud and not arguments.text:
        raise UsageError("--aloud says a command in words: give them, and no plan or answer")
    if not arguments.aloud and (arguments.voice or arguments.snr is not None):
        raise UsageError("--voice and --snr say how words sound: add --aloud")


def follow_aloud(
    session: Session, follower: "Follower", arguments: argparse.Namespace
) -> dict[str, Any]:
    """Have a command said in the twin's room, tell what was heard, return the last event.

    Raises:
        UsageError: there is no twin, the robot is deaf, or it heard no command.
        CommandFailed: the robot heard nothing.
    """
    aloud = Aloud(session)
    hearing = aloud.speak(arguments.text, arguments.voice or USUAL_VOICE, arguments.snr)
    if not arguments.json:
        print(hearing.line(), flush=True)
    heard = {"heard": hearing.told, "end_to_text_s": round(hearing.end_to_text_s, 3)}
    if hearing.told["verdict"] == STOP:
        return {"event": "finished", "success": True, "error": None} | heard
    return follower.narrate(aloud.follow(hearing, follower.pause)) | heard


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
        return self.narrate(self._session.command(self.pause, **utterance))

    def narrate(self, events: Iterable[dict[str, Any]]) -> dict[str, Any]:
        """Tell a command's events and return the last one; Ctrl-C cancels the command."""
        last: dict[str, Any] = {}
        try:
            for event in events:
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

    def pause(self) -> None:
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
