"""`vla-deploy say`: give the robot a command in words, or a plan as JSON, and follow it."""

import argparse
import json
import select
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, TextIO

from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.aloud import DEFAULT_VOICE, STOP, Aloud
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.client.action_words import action_words
from vla_deploy.ipc.payloads.tasks import ActionEvent, PlanEvent, TaskEvent, UtteranceContent

EXIT_ASKED: Final = 3
EXAMPLES = """  vla-deploy say "go to the kitchen"
  vla-deploy say "pick up the red cup and put it in the box"
  vla-deploy say --plan plan.json --json
  vla-deploy say --aloud "go to the kitchen" --voice en-us+f4 --snr 10
  vla-deploy say --answer "the red one"           to what the robot has asked

exit code 3: the robot asks something, and no terminal is there to answer at
"""
_SIGNS: Final[Mapping[str, str]] = {
    "active": "…",
    "succeeded": "✓",
    "aborted": "✗",
    "cancelled": "-",
    "rejected": "✗",
}


def register(commands: Any) -> None:
    """Add the command."""
    say = add_top_command(commands, "say", EXAMPLES, run, json_help="print the outcome as JSON")
    what = say.add_mutually_exclusive_group(required=True)
    what.add_argument("text", nargs="?", help="the command in words")
    what.add_argument("--plan", type=Path, help="a plan as JSON, in any of the known dialects")
    what.add_argument("--answer", metavar="WORDS", help="answer what the robot has asked")
    say.add_argument(
        "--aloud", action="store_true", help="say it by a synthetic voice in the twin's room"
    )
    say.add_argument("--voice", help=f"whose voice, of eSpeak NG (default: {DEFAULT_VOICE})")
    say.add_argument("--snr", type=float, metavar="DB", help="over noise, this much louder")


def run(arguments: argparse.Namespace) -> int:
    """Give the command; Ctrl-C cancels it."""
    if arguments.aloud and not arguments.text:
        raise UsageError("--aloud says a command in words: give them, and no plan or answer")
    if not arguments.aloud and (arguments.voice or arguments.snr is not None):
        raise UsageError("--voice and --snr say how words sound: add --aloud")
    utterance = _utterance(arguments)
    session = attach(arguments.runtime_base)
    follower = Follower(session, quiet=arguments.json)
    if arguments.aloud:
        outcome = _follow_aloud(session, follower, arguments)
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


def _utterance(arguments: argparse.Namespace) -> UtteranceContent:
    if arguments.plan:
        return {"plan": read_json(arguments.plan, "plan")}
    if arguments.answer:
        return {"text": arguments.answer, "answer": True}
    return {"text": arguments.text}


def _follow_aloud(
    session: RobotSession, follower: "Follower", arguments: argparse.Namespace
) -> dict[str, Any]:
    """Speak a command in the twin's room, print what was heard, and return the last event.

    Raises:
        UsageError: there is no twin, the robot understands no speech, or it heard no command.
        CommandFailed: the robot heard nothing.
    """
    aloud = Aloud(session)
    hearing = aloud.speak(arguments.text, arguments.voice or DEFAULT_VOICE, arguments.snr)
    if not arguments.json:
        print(hearing.line(), flush=True)
    heard = {"heard": hearing.heard, "end_to_text_s": round(hearing.end_to_text_s, 3)}
    if hearing.heard["verdict"] == STOP:
        return {"event": "finished", "success": True, "error": None} | heard
    return follower.narrate(aloud.follow(hearing, follower.pause)) | heard


class Follower:
    """Give a command, print its events, and send what the person types as an answer.

    Without a terminal, or where only the outcome is to be printed, a question is the end.
    """

    def __init__(self, session: RobotSession, quiet: bool, terminal: TextIO | None = None) -> None:
        self._session = session
        self._quiet = quiet
        self._terminal = sys.stdin if terminal is None else terminal
        self._is_asked = False

    def follow(self, utterance: UtteranceContent) -> dict[str, Any]:
        """Give a command and return its last event, or a question that cannot be answered here."""
        return self.narrate(self._session.command(self.pause, **utterance))

    def narrate(self, events: Iterable[TaskEvent]) -> dict[str, Any]:
        """Print a command's events and return the last one; Ctrl-C cancels the command."""
        last: dict[str, Any] = {}
        try:
            for event in events:
                last = {**event}
                line = line_of(event)
                if line and not self._quiet and event["event"] != "rejected":
                    print(line, flush=True)
                self._is_asked = event["event"] == "asked"
                if self._is_asked and (self._quiet or not self._terminal.isatty()):
                    break
        except KeyboardInterrupt:
            self._session.cancel()
            raise
        return last

    def pause(self) -> None:
        """Wait for a moment; after a question, a line that is typed is sent as the answer."""
        self._session.pause()
        if self._is_asked and select.select([self._terminal], [], [], 0.0)[0]:
            self._is_asked = False
            typed = self._terminal.readline().strip()
            if typed:
                self._session.utter(text=typed, answer=True)


def line_of(event: TaskEvent) -> str | None:
    """Return one line for a task event, or None for one that adds nothing."""
    match event["event"]:
        case "queued":
            return f"waits for {event['place']} before it"
        case "planning":
            return f"asking {', '.join(event['rungs'])} ..."
        case "asked":
            return f"robot asks: {event['question']}"
        case "plan":
            return _plan_line(event)
        case "action":
            return _action_line(event)
        case "setback":
            return "looking for another way ..."
        case "objective":
            told = event["error"] or event["note"]
            line = f"[{event['part']}] {event['state']}: {event['words']}"
            return f"{line}  ({told})" if told else line
        case "said":
            return f"robot says: {event['text']}"
        case "rejected":
            return f"refused: {event['reason']}"
        case "finished":
            return "done" if event["success"] else f"failed: {event['error']}"
    return None


def _plan_line(event: PlanEvent) -> str:
    actions = event["plan"]["actions"]
    steps = "; ".join(action_words(one["skill"], one["parameters"]) for one in actions)
    back_end = event.get("rung", "")
    by = "" if back_end in ("", "patterns", "given") else f"  (by {back_end})"
    notes = [f"\n  note: {one}" for one in event["plan"].get("notes", ())]
    return f"plan: {steps}{by}" + "".join(notes)


def _action_line(event: ActionEvent) -> str:
    words = action_words(event["skill"], event["parameters"])
    line = f"{_SIGNS.get(event['status'], event['status'])} {words}"
    if event["status"] != "active":
        line += f"  ({event['execution_time_s']:.1f} s)"
    note = event["error"] or event.get("note")
    return f"{line}  {note}" if note else line


def read_json(path: Path, what: str) -> Any:
    """Read a JSON file; `what` names its content in errors.

    Raises:
        UsageError: it cannot be read or is no JSON.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read the {what} {path}: {error.strerror}") from error
    except ValueError as error:
        raise UsageError(f"the {what} {path} is no JSON: {error}") from error
    except RecursionError:
        raise UsageError(f"the {what} {path} is no JSON: it is nested too deeply") from None
