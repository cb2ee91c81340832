"""`vla-deploy rerun`: look at a recording, a flight or the run of this machine in Rerun."""

import argparse
import signal
import time
from pathlib import Path
from typing import Any, Final

from drivers.clock import Clock, MonotonicClock
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.recorded_file import find_recorded
from vla_deploy.cli.session import attach
from vla_deploy.cli.watched_run import watched_run
from vla_deploy.runtime.node import run_node
from vla_deploy.supervisor.runs.runtime import default_base
from vla_deploy.telemetry.recorded_file import read_file
from vla_deploy.telemetry.recording.recording_file import ALL_CHANNELS
from vla_deploy.telemetry.recording.request import ChannelSelection, RecordingRequest, checked
from vla_deploy.telemetry.rerun.conversion import convert
from vla_deploy.telemetry.rerun.entity_logger import EntityLogger
from vla_deploy.telemetry.rerun.live import RerunNode
from vla_deploy.telemetry.rerun.stream import RerunStream
from vla_deploy.telemetry.rerun.viewer import PORT, open_viewer, url_of

SUFFIX: Final = ".rrd"
EXAMPLES = """  vla-deploy rerun latest                 the newest recording, in a viewer that opens
  vla-deploy rerun 000007-estop.mcap --save estop.rrd
  vla-deploy rerun --without rgbd         the run of this machine, live, until Ctrl-C
  vla-deploy rerun --connect rerun+http://192.168.1.20:9876/proxy
"""


def register(commands: Any) -> None:
    """Add the command."""
    rerun = add_top_command(commands, "rerun", EXAMPLES)
    rerun.add_argument(
        "file",
        nargs="?",
        help="a file, the number of a recording, or: latest; none: the run of this machine, live",
    )
    where = rerun.add_mutually_exclusive_group()
    where.add_argument("--save", type=Path, metavar="OUT.rrd", help="write a file for later")
    where.add_argument("--connect", metavar="URL", help="send it to a viewer that is open there")
    where.add_argument("--spawn", action="store_true", help="open a viewer here (default)")
    rerun.add_argument(
        "--topic", action="append", metavar="PATTERN", help="show these, such as 'joint_*'"
    )
    rerun.add_argument(
        "--without", action="append", default=[], metavar="PATTERN", help="but not these"
    )
    rerun.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Show a file, or the run of this machine until Ctrl-C.

    Raises:
        UsageError: what is to be written is no .rrd file.
    """
    if arguments.save is not None and arguments.save.suffix != SUFFIX:
        raise UsageError(f"rerun: --save {arguments.save}: expected a name that ends in {SUFFIX}")
    request = RecordingRequest(
        topics=tuple(arguments.topic or RecordingRequest().topics), without=tuple(arguments.without)
    )
    selection = checked(request, [channel.topic for channel in ALL_CHANNELS]).selection
    if arguments.file is None:
        return _follow(arguments, selection)
    return _convert(arguments, selection)


def _convert(arguments: argparse.Namespace, selection: ChannelSelection) -> int:
    base = arguments.runtime_base or default_base()
    file = read_file(find_recorded(base, arguments.file))
    stream = RerunStream(file.path.stem)
    where = _open(stream, arguments, MonotonicClock())
    logger = EntityLogger(stream)
    messages = convert(file, logger, selection)
    _finish(stream, logger, f"{file.path.name}: {messages} messages", where)
    return 0


def _follow(arguments: argparse.Namespace, selection: ChannelSelection) -> int:
    session = attach(arguments.runtime_base)
    stream = RerunStream(session.run_dir.resolve().name)
    where = _open(stream, arguments, session.clock)
    logger = EntityLogger(stream)
    node = RerunNode(watched_run(session), selection, logger, time.time_ns)
    stops: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _frame: stops.append(got))
    print(f"live, {where}; Ctrl-C ends it", flush=True)
    run_node(node, session.clock, lambda: bool(stops))
    _finish(stream, logger, "live", where)
    return 0


def _open(stream: RerunStream, arguments: argparse.Namespace, clock: Clock) -> str:
    """Open where the entities go, and return it in words."""
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
