"""`vla-deploy flight list | show | judge | save`: what the flight recorder wrote down."""

import argparse
import json
from collections.abc import Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.cli.commands import add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import RobotSession, attach, base_of
from vla_deploy.ipc import Event, topics
from vla_deploy.ipc.payloads.recording import FlightEvent
from vla_deploy.telemetry.channels import TICKS, tick_bytes
from vla_deploy.telemetry.errors import FlightUnreadable
from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.judge import FlightJudgement, judge_again, rules_digest
from vla_deploy.telemetry.recorded_file import RecordedFile, read_flight
from vla_deploy.telemetry.timeline import time_line

SAVE_TIMEOUT_S = 60.0
_OTHER = "judge it there, or record an example flight anew"
EXAMPLES = """  vla-deploy flight list
  vla-deploy flight show latest         what happened, line by line
  vla-deploy flight judge latest        the safety rules must come to the same verdicts again
  vla-deploy flight save --reason "the arm trembles"
"""


def register(commands: Any) -> None:
    """Add the commands."""
    flight = add_top_command(commands, "flight", EXAMPLES)
    acts = flight.add_subparsers(dest="act", required=True, metavar="ACT")
    listing, show, judge, save = (
        add_command(acts, name, summary, EXAMPLES, run, json_help="print it as JSON")
        for name, summary, run in (
            ("list", "list the flights, the oldest first", run_list),
            ("show", "show what happened in a flight, line by line", run_show),
            ("judge", "judge every recorded tick again by the safety rules", run_judge),
            ("save", "save the last half minute of the running robot", run_save),
        )
    )
    for command in (listing, show, judge):
        command.add_argument(
            "--folder", type=Path, help="where flights are (default: the recorder's folder)"
        )
    show.add_argument("flight", help="a file, a number from the list, or: latest")
    judge.add_argument("flight", nargs="+", help="files, numbers from the list, or: latest")
    save.add_argument("--reason", default="", help="why, for the file")


def run_list(arguments: argparse.Namespace) -> int:
    """Print one line per flight."""
    folder = _folder(arguments)
    flights = [_summary_or_fault(path) for path in folder.files()]
    nothing = f"no flights in {folder.path}; one is saved at every stop and crash"
    return emit(arguments, flights, lambda: "\n".join(map(_row, flights)) or nothing)


def _row(flight: Mapping[str, Any]) -> str:
    if "unreadable" in flight:
        return f"{flight['file']}  unreadable: {flight['unreadable']}"
    causes = ", ".join(dict.fromkeys(cause["what"] for cause in flight["causes"]))
    return f"{flight['file']}  {flight['duration_s']:.0f} s  {flight['robot']}  {causes}"


def run_show(arguments: argparse.Namespace) -> int:
    """Print a flight's time line."""
    flight = read_flight(_folder(arguments).find(arguments.flight))
    lines = time_line(flight)
    text = [
        f"{flight.path.name}: {flight.robot}, profile {flight.profile}, run {flight.run_id}",
        f"recorded by version {flight.version} from {_wall(flight, flight.start_ns)}, "
        "0 s is the first cause",
        *(f"{line['at_s']:+9.3f} s  {line['who']:<9}  {line['text']}" for line in lines),
    ]
    return emit(arguments, {**_summary(flight), "lines": lines}, "\n".join(text))


def run_judge(arguments: argparse.Namespace) -> int:
    """Judge flights again; exit 1 when this version comes to another verdict."""
    folder, agreed, results = _folder(arguments), True, []
    for name in arguments.flight:
        path = folder.find(name)
        flight = read_flight(path)
        judgement = judge_again(tick_bytes(message.text) for message in flight.messages(TICKS))
        agreed &= judgement.difference is None
        same = flight.rules == rules_digest()
        results.append({"file": path.name, "same_rules": same, **asdict(judgement)})
        if not arguments.json:
            print(f"{path.name}: {_verdict(judgement)}")
            if judgement.difference and not same:
                print(
                    f"  recorded by other rules than these, of a version {flight.version}: {_OTHER}"
                )
    if arguments.json:
        print(json.dumps(results, indent=2))
    return 0 if agreed else 1


def run_save(arguments: argparse.Namespace) -> int:
    """Ask the running recorder for a flight and wait for it.

    Raises:
        CommandFailed: it could not be written, or the recorder does not answer.
    """
    session = attach(arguments.runtime_base)
    answer = _save(session, arguments.reason)
    if answer is None:
        raise CommandFailed("the recorder does not answer; see: vla-deploy status")
    if answer["event"] != "saved":
        raise CommandFailed(f"the flight could not be saved: {answer['reason']}")
    return emit(arguments, answer, answer["file"])


def _save(session: RobotSession, reason: str) -> FlightEvent | None:
    """Request a flight; return the recorder's answer, None when it is silent."""
    answers = session.events(topics.FLIGHT_EVENT)
    session.writer(topics.FLIGHT_REQUEST).publish({"source": session.source, "reason": reason})

    def look() -> Event[FlightEvent] | None:
        events = answers.drain()
        return next((one for one in events if "request" in one.payload["causes"]), None)

    answer = session.wait_for(look, SAVE_TIMEOUT_S)
    return None if answer is None else answer.payload


def _folder(arguments: argparse.Namespace) -> FlightFolder:
    return FlightFolder(arguments.folder or folder_of(base_of(arguments)))


def _summary_or_fault(path: Path) -> Mapping[str, Any]:
    """Return a flight's summary, or why it cannot be read, so that the others are listed."""
    try:
        return _summary(read_flight(path))
    except FlightUnreadable as error:
        return {"file": path.name, "unreadable": str(error)}


def _summary(flight: RecordedFile) -> Mapping[str, Any]:
    return {
        "file": flight.path.name,
        "bytes": flight.path.stat().st_size,
        "begin": _wall(flight, flight.start_ns),
        "duration_s": (flight.end_ns - flight.start_ns) / NS_PER_S,
        "run_id": flight.run_id,
        "robot": flight.robot,
        "profile": flight.profile,
        "version": flight.version,
        "causes": flight.causes,
        "messages": flight.counts,
    }


def _wall(flight: RecordedFile, stamp_ns: int) -> str:
    at_s = (stamp_ns + flight.wall_offset_ns) / NS_PER_S
    return f"{datetime.fromtimestamp(at_s, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _verdict(judgement: FlightJudgement) -> str:
    unread = f"; {judgement.unread} before the first complete one" if judgement.unread else ""
    difference = judgement.difference
    if difference is None:
        return f"{judgement.ticks} ticks, the same verdicts{unread}"
    return (
        f"tick {difference.tick} differs: {difference.field}: recorded {difference.recorded}, "
        f"judged {difference.judged}{unread}"
    )
