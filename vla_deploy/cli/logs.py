"""`vla-deploy logs`: what the processes of this run, or of an ended one, have logged."""

import argparse
import json
import logging
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.supervisor.runs.log_files import (
    LogLine,
    LogTail,
    as_line,
    last_output,
    processes_in,
    read_log,
)
from vla_deploy.supervisor.runs.runtime import default_base, old_logs, running

EXAMPLES = """  vla-deploy logs                          all processes of the run, in order of time
  vla-deploy logs control --follow         one process, as it goes on
  vla-deploy logs --level warning --json   what went wrong, one JSON object per line
  vla-deploy logs --last-run               the run that has ended last
"""
LEVELS = ("debug", "info", "warning", "error")
OUTPUT_LINES = 200
_POLL_NS = NS_PER_S // 5


def register(commands: Any) -> None:
    """Add the command."""
    logs = add_top_command(commands, "logs", EXAMPLES)
    logs.add_argument("process", nargs="?", help="one process of the table, e.g. control")
    logs.add_argument("--follow", action="store_true", help="go on until Ctrl-C or the run's end")
    logs.add_argument("--level", choices=LEVELS, default="info", help="the least level to show")
    logs.add_argument("--json", action="store_true", help="print one JSON object per line")
    logs.add_argument("--last-run", action="store_true", help="the run that has ended last")
    logs.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the log."""
    base = arguments.runtime_base or default_base()
    if arguments.follow and arguments.last_run:
        raise UsageError("logs: an ended run writes no more: choose --follow or --last-run")
    folder = _ended(base) if arguments.last_run else _current(base)
    names = _chosen(folder, arguments.process)
    if arguments.follow:
        _follow(base, folder, names, arguments, MonotonicClock())
        return 0
    _print([line for name in names for line in read_log(folder, name)], arguments)
    if arguments.process and not arguments.json:
        _print_output(folder, arguments.process)
    return 0


def _current(base: Path) -> Path:
    owner = running(base)
    if owner is None:
        raise UsageError(f"no robot runs in {base}; for the run before: vla-deploy logs --last-run")
    return Path(owner.run_dir) / LOGS_DIR


def _ended(base: Path) -> Path:
    folder = old_logs(state_dir_of(base))
    entries = folder.entries()
    if not entries:
        raise UsageError(f"no run has left logs in {folder.path}; start one: vla-deploy run --twin")
    return entries[-1]


def _chosen(folder: Path, process: str | None) -> list[str]:
    names = processes_in(folder)
    if process is None:
        return names
    if process not in names:
        raise UsageError(f"no log of {process!r} in {folder}; there are {', '.join(names)}")
    return [process]


def _follow(
    base: Path, folder: Path, names: list[str], arguments: argparse.Namespace, clock: Clock
) -> None:
    tails = [LogTail(folder, name) for name in names]
    while True:
        goes_on = running(base) is not None
        _print([line for tail in tails for line in tail.fresh()], arguments)
        if not goes_on:
            return
        clock.sleep_until(clock.now_ns() + _POLL_NS)


def _print(lines: Iterable[LogLine], arguments: argparse.Namespace) -> None:
    levels = logging.getLevelNamesMapping()
    least = levels[arguments.level.upper()]
    for line in sorted(lines, key=lambda line: int(line["stamp_ns"])):
        if levels.get(str(line["level"]), logging.CRITICAL) >= least:
            print(json.dumps(line) if arguments.json else as_line(line), flush=True)


def _print_output(folder: Path, process: str) -> None:
    output = last_output(folder, process, OUTPUT_LINES)
    if output:
        print(f"--- what {process} has written past its log ---", *output, sep="\n")
