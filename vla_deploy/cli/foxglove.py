"""`vla-deploy foxglove`: let viewers watch the run live, over Foxglove's WebSocket protocol."""

import argparse
import signal
import time
from typing import Any

from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.session import attach
from vla_deploy.cli.watched_run import watched_run
from vla_deploy.runtime.node import run_node
from vla_deploy.telemetry.foxglove import FoxgloveNode
from vla_deploy.telemetry.recording.settings import read_settings

EXAMPLES = """  vla-deploy foxglove                   then open ws://127.0.0.1:8765 in Foxglove
  vla-deploy foxglove --port 9000
"""


def register(commands: Any) -> None:
    """Add the command."""
    foxglove = add_top_command(commands, "foxglove", EXAMPLES)
    foxglove.add_argument("--port", type=int, help="instead of that of recording.toml (8765)")
    foxglove.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Serve the run of this machine, a robot's or a replay's, until Ctrl-C."""
    session = attach(arguments.runtime_base)
    settings = read_settings(session.base).foxglove
    if arguments.port is not None:
        settings = type(settings).model_validate({**settings.model_dump(), "port": arguments.port})
    node = FoxgloveNode(watched_run(session), settings, time.time_ns)
    stops: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda got, _frame: stops.append(got))
    print(f"viewers: ws://{settings.host}:{settings.port}; Ctrl-C ends it", flush=True)
    run_node(node, session.clock, lambda: bool(stops))
    return 0
