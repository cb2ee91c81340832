"""`vla-deploy flight list | show | judge | save`: what the flight recorder wrote down."""

import argparse
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.example import add_command, add_top_command
from vla_deploy.cli.session import attach
from vla_deploy.supervisor.runs.runtime import default_base
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
    listing = _add(acts, "list", "list the flights, the oldest first", run_list)
    show = _add(acts, "show", "tell what happened in a flight, line by line", run_show)
    judge = _add(acts, "judge", "judge every recorded tick again by the safety rules", run_judge)
    save = _add(acts, "save", "save the last half minute of the running robot", run_save)
    for command in (listing, show, judge):
        command.add_argument(
            "--folder", type=Path, help="where flights are (default: the recorder's folder)"
        )
    show.add_argument("flight", help="a file, a number from the list, or: latest")
    judge.add_argument("flight", nargs="+", help="files, numbers from the list, or: latest")
    save.add_argument("--reason", default="", help="why, for the file")


def _add(
    acts: Any, name: str, summary: str, run: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    command = add_command(acts, name, summary, EXAMPLES)
    command.add_argument("--json", action="store_true", help="print it as JSON")
    command.set_defaults(run=run)
    return command


def run_list(arguments: argparse.Namespace) -> int:
    """Print one line per flight."""
    folder = _folder(arguments)
    flights = [_summary_or_why_not(path) for path in folder.files()]
    if arguments.json:
        print(json.dumps(flights, indent=2))
    elif not flights:
        print(f"no flights in {folder.path}; one is saved at every stop and crash")
    for one in () if arguments.json else flights:
        print(_row(one))
    return 0


def _row(flight: Mapping[str, Any]) -> str:
    if "unreadable" in flight:
        return f"{flight['file']}  unreadable: {flight['unreadable']}"
    causes = ", ".join(dict.fromkeys(cause["what"] for cause in flight["causes"]))
    return f"{flight['file']}  {flight['duration_s']:.0f} s  {flight['robot']}  {causes}"


def run_show(arguments: argparse.Namespace) -> int:
    """Print a flight's time line."""
    flight = read_flight(_folder(arguments).find(arguments.flight))
    lines = time_line(flight)
    if arguments.json:
        print(json.dumps({**_summary(flight), "lines": lines}, indent=2))
        return 0
    begin = _wall(flight, flight.start_ns)
    print(f"{flight.path.name}: {flight.robot}, profile {flight.profile}, run {flight.run_id}")
    print(f"recorded by version {flight.version} from {begin}, 0 s is the first cause")
    for line in lines:
        print(f"{line['at_s']:+9.3f} s  {line['who']:<9}  {line['text']}")
    return 0


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
        if not arguments.json and judgement.difference and not same:
            print(f"  recorded by other rules than these, of a version {flight.version}: {_OTHER}")
    if arguments.json:
        print(json.dumps(results, indent=2))
    return 0 if agreed else 1


def run_save(arguments: argparse.Namespace) -> int:
    """Ask the running recorder for a flight and wait for it.

    Raises:
        CommandFailed: it could not be written, or the recorder does not answer.
    """
    session = attach(arguments.runtime_base)
    answer = session.save_flight(arguments.reason, SAVE_TIMEOUT_S)
    if answer is None:
        raise CommandFailed("the recorder does not answer; see: vla-deploy status")
    if answer["event"] != "saved":
        raise CommandFailed(f"the flight could not be saved: {answer['reason']}")
    print(json.dumps(answer, indent=2) if arguments.json else answer["file"])
    return 0


def _folder(arguments: argparse.Namespace) -> FlightFolder:
    return FlightFolder(arguments.folder or folder_of(arguments.runtime_base or default_base()))


def _summary_or_why_not(path: Path) -> Mapping[str, Any]:
    """Sum a flight up; one that is cut off or spoiled hides no other one."""
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
