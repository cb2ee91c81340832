"""`vla-deploy foxglove | rerun`: show the run of this machine, or a recorded file, in a viewer."""

import argparse
import time
from pathlib import Path
from typing import Any, Final

from drivers.clock import Clock, MonotonicClock
from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.recording.runs import (
    add_topic_arguments,
    find_recorded,
    run_until_stopped,
    topic_request,
    watched_run,
)
from vla_deploy.cli.session import attach, base_of
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.request import ChannelSelection
from vla_deploy.telemetry.rerun.conversion import convert
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger
from vla_deploy.telemetry.rerun.live import RerunNode
from vla_deploy.telemetry.rerun.stream import RerunStream
from vla_deploy.telemetry.rerun.viewer import PORT, open_viewer, url_of

_SUFFIX: Final = ".rrd"
_FOXGLOVE_EXAMPLES: Final = """\
  vla-deploy foxglove                   then open ws://127.0.0.1:8765 in Foxglove
  vla-deploy foxglove --port 9000
"""
_RERUN_EXAMPLES: Final = """\
  vla-deploy rerun latest                 the newest recording, in a viewer that opens
  vla-deploy rerun 000007-estop.mcap --save estop.rrd
  vla-deploy rerun --without rgbd         the run of this machine, live, until Ctrl-C
  vla-deploy rerun --connect rerun+http://192.168.1.20:9876/proxy
"""


def register(commands: Any) -> None:
    """Add the commands."""
    foxglove = add_top_command(commands, "foxglove", _FOXGLOVE_EXAMPLES, run_foxglove)
    foxglove.add_argument("--port", type=int, help="instead of that of recording.toml (8765)")
    rerun = add_top_command(commands, "rerun", _RERUN_EXAMPLES, run_rerun)
    rerun.add_argument(
        "file",
        nargs="?",
        help="a file, the number of a recording, or: latest; none: the run of this machine, live",
    )
    where = rerun.add_mutually_exclusive_group()
    where.add_argument("--save", type=Path, metavar="OUT.rrd", help="write a file for later")
    where.add_argument("--connect", metavar="URL", help="send it to a viewer that is open there")
    where.add_argument("--spawn", action="store_true", help="open a viewer here (default)")
    add_topic_arguments(rerun, "show")


def run_foxglove(arguments: argparse.Namespace) -> int:
    """Serve the run of this machine, a robot's or a replay's, until Ctrl-C."""
    from vla_deploy.telemetry.foxglove import FoxgloveNode  # loads pydantic
    from vla_deploy.telemetry.recording.settings import read_settings

    session = attach(arguments.runtime_base)
    settings = read_settings(session.base).foxglove
    if arguments.port is not None:
        settings = type(settings).model_validate({**settings.model_dump(), "port": arguments.port})
    node = FoxgloveNode(watched_run(session), settings, time.time_ns)
    print(f"viewers: ws://{settings.host}:{settings.port}; Ctrl-C ends it", flush=True)
    run_until_stopped(node, session)
    return 0


def run_rerun(arguments: argparse.Namespace) -> int:
    """Show a file, or the run of this machine until Ctrl-C.

    Raises:
        UsageError: the file to write is no .rrd file.
    """
    if arguments.save is not None and arguments.save.suffix != _SUFFIX:
        raise UsageError(f"rerun: --save {arguments.save}: expected a name that ends in {_SUFFIX}")
    selection = topic_request(arguments).selection
    if arguments.file is None:
        _show_live(arguments, selection)
    else:
        _show_file(arguments, selection)
    return 0


def _show_file(arguments: argparse.Namespace, selection: ChannelSelection) -> None:
    file = read_file(find_recorded(base_of(arguments), arguments.file))
    stream = RerunStream(file.path.stem)
    where = _open(stream, arguments, MonotonicClock())
    logger = EntityLogger(stream)
    messages = convert(file, logger, selection)
    _finish(stream, logger, f"{file.path.name}: {messages} messages", where)


def _show_live(arguments: argparse.Namespace, selection: ChannelSelection) -> None:
    session = attach(arguments.runtime_base)
    stream = RerunStream(session.run_dir.resolve().name)
    where = _open(stream, arguments, session.clock)
    logger = EntityLogger(stream)
    node = RerunNode(watched_run(session), selection, logger, time.time_ns)
    print(f"live, {where}; Ctrl-C ends it", flush=True)
    run_until_stopped(node, session)
    _finish(stream, logger, "live", where)


def _open(stream: RerunStream, arguments: argparse.Namespace, clock: Clock) -> str:
    """Open the file or the viewer, and return its name for a message."""
    if arguments.save is not None:
        stream.save(arguments.save)
        return f"into {arguments.save}"
    if arguments.connect is None:
        open_viewer(PORT, clock)
    url = arguments.connect or url_of(PORT)
    stream.connect(url)
    return f"to the viewer at {url}"


def _finish(stream: RerunStream, logger: EntityLogger, what: str, where: str) -> None:
    stream.flush()
    stream.close()
    print(f"{what}: {logger.shown.total()} values of {len(logger.shown)} entities {where}")
    for channel, count in logger.unfit.most_common():
        print(f"left out, as they do not fit: {count} of {channel}")
