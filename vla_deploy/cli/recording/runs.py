"""Find what a viewer or exporter reads: a recorded file, or the run of this machine."""

import argparse
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import topics
from vla_deploy.runtime.node import Node, NodeContext, run_node
from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import RecordingRequest, checked


def find_recorded(base: Path, name: str) -> Path:
    """Return the file of that name, the recording of that number, or the newest of both kinds.

    Raises:
        FlightMissing: there is none.
    """
    if Path(name).is_file():
        return Path(name)
    folders = (RecordingFolder(recordings_dir_of(base)), FlightFolder(folder_of(base)))
    for folder in folders:
        if (name == "latest" and folder.files()) or name in {path.name for path in folder.files()}:
            return folder.find(name)
    return folders[0].find(name)


def watched_run(session: RobotSession) -> NodeContext:
    """Return the context of a node that only watches this run, a robot's or a replay's."""
    table, replay = session.document(topics.PROCESS_TABLE), session.document(topics.REPLAY_STATUS)
    head = table or replay
    return NodeContext(
        run_dir=Path(session.run_dir),
        robot="butler" if head is None else head["robot"],
        profile="" if table is None else table["profile"],
        devices_dir=None,
        clock=session.clock,
    )


def run_until_stopped(node: Node, session: RobotSession) -> None:
    """Run a node that watches the run until Ctrl-C or SIGTERM."""
    run_node(node, session.clock, stop_requested())


def stop_requested(*more: signal.Signals) -> Callable[[], bool]:
    """Handle Ctrl-C, SIGTERM and `more`; return a function that says whether one came."""
    received: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, *more):
        signal.signal(number, lambda got, _frame: received.append(got))
    return lambda: bool(received)


def add_topic_arguments(command: argparse.ArgumentParser, verb: str) -> None:
    """Add the patterns that select topics; `verb` says what is done with those."""
    command.add_argument(
        "--topic", action="append", metavar="PATTERN", help=f"{verb} these, such as 'joint_*'"
    )
    command.add_argument(
        "--without", action="append", default=[], metavar="PATTERN", help="but not these"
    )


def topic_request(arguments: argparse.Namespace, **more: Any) -> RecordingRequest:
    """Return the recording request that the patterns and `more` make.

    Raises:
        RecordingRefused: a pattern matches no topic, or a value is out of range.
    """
    topics = tuple(arguments.topic or RecordingRequest().topics)
    request = RecordingRequest(topics=topics, without=tuple(arguments.without), **more)
    return checked(request, [channel.topic for channel in ALL_CHANNELS])
