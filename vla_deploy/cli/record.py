"""`vla-deploy record start | stop | status | list | topics | once`: record what the robot does."""

import argparse
import json
import os
import signal
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.example import add_command, add_top_command
from vla_deploy.cli.session import Session, attach
from vla_deploy.cli.watched_run import watched_run
from vla_deploy.supervisor.runs.runtime import default_base
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.once import OneRecording
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import STOP, RecordingRequest, checked
from vla_deploy.telemetry.recording.settings import read_settings

ANSWER_WITHIN_S = 5.0
_STATUS_AGE_S = 3.0
EXAMPLES = """  vla-deploy record start                      everything, until: record stop
  vla-deploy record start --topic 'joint_*' --topic pose --duration 60
  vla-deploy record start --without rgbd --label kitchen
  vla-deploy record once --duration 30 -o run.mcap   into a file of your own
  vla-deploy record list
"""


def register(commands: Any) -> None:
    """Add the commands."""
    record = add_top_command(commands, "record", EXAMPLES)
    acts = record.add_subparsers(dest="act", required=True, metavar="ACT")
    start = _add(acts, "start", "have the recorder write rolling files", run_start)
    _add(acts, "stop", "end the recording; its file is finished", run_stop)
    _add(acts, "status", "tell whether a recording is made, into which file", run_status)
    listing = _add(acts, "list", "list the recordings, the oldest first", run_list)
    _add(acts, "topics", "list the names that can be recorded", run_topics)
    once = _add(acts, "once", "record into one file, without the recorder", run_once)
    listing.add_argument("--folder", type=Path, help="where recordings are (default: the robot's)")
    for command in (start, once):
        command.add_argument(
            "--topic", action="append", metavar="PATTERN", help="record these, such as 'joint_*'"
        )
        command.add_argument(
            "--without", action="append", default=[], metavar="PATTERN", help="but not these"
        )
        command.add_argument("--duration", type=float, metavar="S", help="end after so long")
    start.add_argument("--label", default="recording", help="a word for the file's name")
    once.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="where to write it"
    )


def _add(
    acts: Any, name: str, summary: str, run: Callable[[argparse.Namespace], int]
) -> argparse.ArgumentParser:
    command = add_command(acts, name, summary, EXAMPLES)
    command.add_argument("--json", action="store_true", help="print it as JSON")
    command.set_defaults(run=run)
    return command


def run_start(arguments: argparse.Namespace) -> int:
    """Ask the recorder to begin, and wait until it does.

    Raises:
        CommandFailed: it does not.
    """
    request = _request(arguments, label=arguments.label)
    session = attach(arguments.runtime_base)
    session.publish("recording_request", request.document())
    told = _wait(session, lambda status: status.get("source") == request.source)
    _print(told, arguments)
    return 0


def run_stop(arguments: argparse.Namespace) -> int:
    """Ask the recorder to end, and wait until it has.

    Raises:
        CommandFailed: it does not.
    """
    session = attach(arguments.runtime_base)
    session.publish("recording_request", {"act": STOP, "source": session.source})
    _print(_wait(session, lambda status: status["state"] == "off"), arguments)
    return 0


def run_status(arguments: argparse.Namespace) -> int:
    """Print what the recorder says.

    Raises:
        CommandFailed: it is silent.
    """
    status = attach(arguments.runtime_base).document("recording_status", _STATUS_AGE_S)
    if status is None:
        raise CommandFailed("the recorder is silent; see: vla-deploy status")
    _print(status, arguments)
    return 0


def run_list(arguments: argparse.Namespace) -> int:
    """Print one line per recording."""
    base = arguments.runtime_base or default_base()
    folder = RecordingFolder(arguments.folder or recordings_dir_of(base))
    found = [read_file(path).document() for path in folder.files()]
    if arguments.json:
        print(json.dumps(found, indent=2))
        return 0
    for one in found:
        began = f"{datetime.fromtimestamp(one['began_s'], UTC):%Y-%m-%d %H:%M:%S} UTC"
        size = f"{one['bytes'] / 1e6:.1f} MB"
        print(f"{one['name']}  {began}  {one['duration_s']:.0f} s  {size}  {one['robot']}")
    for part in folder.unfinished_files():
        print(f"{part.name}  not finished: being written, or recovered when the recorder next runs")
    if not found:
        print(f"no recordings in {folder.path}; begin one: vla-deploy record start")
    return 0


def run_topics(arguments: argparse.Namespace) -> int:
    """Print every name, with its schema."""
    names = {channel.topic: channel.schema_name for channel in ALL_CHANNELS}
    if arguments.json:
        print(json.dumps(names, indent=2))
        return 0
    for name, schema in names.items():
        print(f"{name:<24} {schema}")
    return 0


def run_once(arguments: argparse.Namespace) -> int:
    """Record into one file until the time is over, or Ctrl-C."""
    request = _request(arguments)
    session = attach(arguments.runtime_base)
    settings = read_settings(session.base).recording
    one = OneRecording(
        watched_run(session),
        request,
        arguments.output,
        image_period_s=settings.image_period_s,
        wall_ns=time.time_ns,
    )
    stops: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _frame: stops.append(got))
    messages = one.run(lambda: bool(stops))
    told = {"file": str(arguments.output), "messages": messages}
    print(json.dumps(told) if arguments.json else f"{told['file']}: {messages} messages")
    return 0


def _request(arguments: argparse.Namespace, label: str = "recording") -> RecordingRequest:
    request = RecordingRequest(
        topics=tuple(arguments.topic or RecordingRequest().topics),
        without=tuple(arguments.without),
        duration_s=arguments.duration,
        label=label,
        source=f"cli-{os.getpid()}",
    )
    return checked(request, [channel.topic for channel in ALL_CHANNELS])


def _wait(session: Session, reached: Callable[[Mapping[str, Any]], bool]) -> dict[str, Any]:
    end_ns = session.clock.now_ns() + round(ANSWER_WITHIN_S * NS_PER_S)
    while session.clock.now_ns() < end_ns:
        status = session.document("recording_status", _STATUS_AGE_S)
        if status is not None and reached(status):
            return status
        session.pause()
    raise CommandFailed("the recorder does not answer; see: vla-deploy status")


def _print(status: Mapping[str, Any], arguments: argparse.Namespace) -> None:
    if arguments.json:
        print(json.dumps(status, indent=2))
        return
    if status["state"] == "off":
        last = status["last"]
        done = f"; the last one: {last['messages']} messages, {last['lost']} lost" if last else ""
        print(f"not recording{done}")
        return
    why = f" ({status['why']})" if status["why"] else ""
    left = "" if status["left_s"] is None else f", {status['left_s']:.0f} s left"
    print(
        f"{status['state']}{why}: {status['topics']} by {status['source']}{left}; "
        f"{status['file'] or 'no file yet'}, {status['file_bytes'] / 1e6:.1f} MB, "
        f"{status['messages']} messages, {status['lost']} lost"
    )
