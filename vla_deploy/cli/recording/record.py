"""`vla-deploy record start | stop | status | list | topics | once | export`: record a run."""

import argparse
import os
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.commands import add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.recording import export
from vla_deploy.cli.recording.runs import (
    add_topic_arguments,
    stop_requested,
    topic_request,
    watched_run,
)
from vla_deploy.cli.session import RobotSession, attach, base_of
from vla_deploy.ipc import topics
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.once import OneRecording
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import STOP
from vla_deploy.telemetry.recording.settings import read_settings

ANSWER_WITHIN_S: Final = 5.0
_STATUS_AGE_S: Final = 3.0
EXAMPLES: Final = """  vla-deploy record start                      everything, until: record stop
  vla-deploy record start --topic 'joint_*' --topic pose --duration 60
  vla-deploy record start --without rgbd --label kitchen
  vla-deploy record once --duration 30 -o run.mcap   into a file of your own
  vla-deploy record list
  vla-deploy record export latest -o pick_cube       as a LeRobot dataset
"""
Status = Mapping[str, Any]


def register(commands: Any) -> None:
    """Add the commands."""
    acts = add_top_command(commands, "record", EXAMPLES).add_subparsers(
        dest="act", required=True, metavar="ACT"
    )
    added = {}
    for name, summary, run in (
        ("start", "have the recorder write rolling files", run_start),
        ("stop", "end the recording; its file is finished", run_stop),
        ("status", "show whether a recording is made, into which file", run_status),
        ("list", "list the recordings, the oldest first", run_list),
        ("topics", "list the names that can be recorded", run_topics),
        ("once", "record into one file, without the recorder", run_once),
    ):
        example = f"  vla-deploy record {name}"
        examples = EXAMPLES if example in EXAMPLES else f"{example}\n"
        added[name] = add_command(acts, name, summary, examples, run, json_help="print it as JSON")
    for name in ("start", "once"):
        add_topic_arguments(added[name], "record")
        added[name].add_argument("--duration", type=float, metavar="S", help="end after so long")
    added["start"].add_argument("--label", default="recording", help="a word for the file's name")
    added["once"].add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="where to write it"
    )
    export.register(acts)
    added["list"].add_argument(
        "--folder", type=Path, help="where recordings are (default: the robot's)"
    )


def run_start(arguments: argparse.Namespace) -> int:
    """Ask the recorder to begin, and wait until it does."""
    request = topic_request(
        arguments, duration_s=arguments.duration, label=arguments.label, source=_source()
    )
    session = attach(arguments.runtime_base)
    session.writer(topics.RECORDING_REQUEST).publish(request.document())
    status = _wait(session, lambda status: status.get("source") == request.source)
    return emit(arguments, status, lambda: _words(status))


def run_stop(arguments: argparse.Namespace) -> int:
    """Ask the recorder to end, and wait until it has."""
    session = attach(arguments.runtime_base)
    session.writer(topics.RECORDING_REQUEST).publish({"act": STOP, "source": session.source})
    status = _wait(session, lambda status: status["state"] == "off")
    return emit(arguments, status, lambda: _words(status))


def run_status(arguments: argparse.Namespace) -> int:
    """Print the recorder's status.

    Raises:
        CommandFailed: it is silent.
    """
    status = attach(arguments.runtime_base).document(topics.RECORDING_STATUS, _STATUS_AGE_S)
    if status is None:
        raise CommandFailed("the recorder is silent; see: vla-deploy status")
    return emit(arguments, status, lambda: _words(status))


def run_list(arguments: argparse.Namespace) -> int:
    """Print one line per recording."""
    folder = RecordingFolder(arguments.folder or recordings_dir_of(base_of(arguments)))
    found = [read_file(path).document() for path in folder.files()]
    lines = [_recording_line(one) for one in found]
    lines += [
        f"{part.name}  not finished: being written, or recovered when the recorder next runs"
        for part in folder.unfinished_files()
    ]
    if not found:
        lines.append(f"no recordings in {folder.path}; begin one: vla-deploy record start")
    return emit(arguments, found, "\n".join(lines))


def run_topics(arguments: argparse.Namespace) -> int:
    """Print every name, with its schema."""
    names = {channel.topic: channel.schema_name for channel in ALL_CHANNELS}
    lines = [f"{name:<24} {schema}" for name, schema in names.items()]
    return emit(arguments, names, "\n".join(lines))


def run_once(arguments: argparse.Namespace) -> int:
    """Record into one file until the time is over, or Ctrl-C."""
    request = topic_request(arguments, duration_s=arguments.duration, source=_source())
    session = attach(arguments.runtime_base)
    one = OneRecording(
        watched_run(session),
        request,
        arguments.output,
        image_period_s=read_settings(session.base).recording.image_period_s,
        wall_ns=time.time_ns,
    )
    messages = one.run(stop_requested())
    document = {"file": str(arguments.output), "messages": messages}
    return emit(arguments, document, f"{arguments.output}: {messages} messages", indent=None)


def _source() -> str:
    return f"cli-{os.getpid()}"


def _wait(session: RobotSession, reached: Callable[[Status], bool]) -> Status:
    """Return the first status of the recorder that fits.

    Raises:
        CommandFailed: none comes in time.
    """

    def look() -> Status | None:
        status = session.document(topics.RECORDING_STATUS, _STATUS_AGE_S)
        return status if status is not None and reached(status) else None

    status = session.wait_for(look, ANSWER_WITHIN_S)
    if status is None:
        raise CommandFailed("the recorder does not answer; see: vla-deploy status")
    return status


def _recording_line(one: Mapping[str, Any]) -> str:
    began = f"{datetime.fromtimestamp(one['began_s'], UTC):%Y-%m-%d %H:%M:%S} UTC"
    size = f"{one['bytes'] / 1e6:.1f} MB"
    return f"{one['name']}  {began}  {one['duration_s']:.0f} s  {size}  {one['robot']}"


def _words(status: Status) -> str:
    if status["state"] == "off":
        last = status["last"]
        done = f"; the last one: {last['messages']} messages, {last['lost']} lost" if last else ""
        return f"not recording{done}"
    why = f" ({status['why']})" if status["why"] else ""
    left = "" if status["left_s"] is None else f", {status['left_s']:.0f} s left"
    return (
        f"{status['state']}{why}: {status['topics']} by {status['source']}{left}; "
        f"{status['file'] or 'no file yet'}, {status['file_bytes'] / 1e6:.1f} MB, "
        f"{status['messages']} messages, {status['lost']} lost"
    )
