"""`vla-deploy logs | crashes`: what the processes of a run have logged, and how they crashed."""

import argparse
import json
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import base_of
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.supervisor.processes.crash_reports import crash_folder
from vla_deploy.supervisor.runs.log_files import (
    LogLine,
    LogTail,
    as_line,
    last_output,
    processes_in,
    read_log,
)
from vla_deploy.supervisor.runs.runtime import old_logs, running

LOGS_EXAMPLES: Final = """\
  vla-deploy logs                          all processes of the run, in order of time
  vla-deploy logs control --follow         one process, as it goes on
  vla-deploy logs --level warning --json   what went wrong, one JSON object per line
  vla-deploy logs --last-run               the run that has ended last
"""
CRASHES_EXAMPLES: Final = """\
  vla-deploy crashes list
  vla-deploy crashes show 000003-perception
  vla-deploy crashes show --json           the newest one, as JSON
"""
LEVELS = ("debug", "info", "warning", "error")
OUTPUT_LINES = 200
_POLL_NS = NS_PER_S // 5


def register(commands: Any) -> None:
    """Add the commands."""
    logs = add_top_command(
        commands, "logs", LOGS_EXAMPLES, run_logs, json_help="print one JSON object per line"
    )
    logs.add_argument("process", nargs="?", help="one process of the table, e.g. control")
    logs.add_argument("--follow", action="store_true", help="go on until Ctrl-C or the run's end")
    logs.add_argument("--level", choices=LEVELS, default="info", help="the least level to show")
    logs.add_argument("--last-run", action="store_true", help="the run that has ended last")
    crashes = add_top_command(
        commands, "crashes", CRASHES_EXAMPLES, run_crashes, json_help="print JSON"
    )
    crashes.add_argument("act", choices=("list", "show"), help="all in a line each, or one whole")
    crashes.add_argument("crash", nargs="?", help="its name in the list (default: the newest)")


def run_logs(arguments: argparse.Namespace) -> int:
    """Print the log."""
    base = base_of(arguments)
    if arguments.follow and arguments.last_run:
        raise UsageError("logs: an ended run writes no more: choose --follow or --last-run")
    folder = _ended(base) if arguments.last_run else _current(base)
    names = _chosen_processes(folder, arguments.process)
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


def _chosen_processes(folder: Path, process: str | None) -> list[str]:
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


def run_crashes(arguments: argparse.Namespace) -> int:
    """List the reports, the newest last, or show one."""
    folder = crash_folder(state_dir_of(base_of(arguments)))
    reports = {path.stem: path for path in folder.entries()}
    if arguments.act == "show":
        report = _read(_chosen_report(reports, arguments.crash))
        return emit(arguments, report, lambda: _report_text(report))
    rows = [{"crash": name, **_read_or_fault(path)} for name, path in reports.items()]
    nothing = "no process has crashed"
    return emit(arguments, rows, lambda: "\n".join(map(_row, rows)) or nothing)


def _chosen_report(reports: Mapping[str, Path], name: str | None) -> Path:
    if not reports:
        raise UsageError("no process has crashed: there is nothing to show")
    chosen = list(reports)[-1] if name is None else name
    if chosen not in reports:
        raise UsageError(f"no crash report {chosen!r}; see: vla-deploy crashes list")
    return reports[chosen]


def _read(path: Path) -> dict[str, Any]:
    try:
        report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise UsageError(f"{path}: not whole, expected JSON: {error}; delete it") from error
    return report


def _read_or_fault(path: Path) -> dict[str, Any]:
    """Return a report, or why it cannot be read, so that the others are listed."""
    try:
        return _read(path)
    except UsageError as error:
        return {"unreadable": str(error)}


def _row(report: dict[str, Any]) -> str:
    if "unreadable" in report:
        return f"{report['crash']:<24} unreadable: {report['unreadable']}"
    return f"{report['crash']:<24} {report['time']}  {report['reason']}"


def _report_text(report: dict[str, Any]) -> str:
    ended = report["signal"] or f"exit code {report['exit_code']}"
    topics = [f"  {name}: {topic['age_s']} s" for name, topic in report["topics"].items()]
    return "\n".join(
        [
            f"{report['process']} (pid {report['pid']}): {report['reason']}",
            f"ended by {ended} at {report['time']} after {report['uptime_s']} s, "
            f"restarts before: {report['restarts']}",
            f"run {report['run_id']}, robot {report['robot']}, profile {report['profile']}",
            *_section("traceback", report["traceback"]),
            *_section("last lines of its log", report["last_log"]),
            *_section("written past its log", report["last_output"]),
            *_section("age of the topics", topics),
        ]
    )


def _section(title: str, lines: list[str]) -> list[str]:
    return ["", f"{title}:", *lines] if lines else []
