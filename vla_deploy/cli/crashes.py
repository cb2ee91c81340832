"""`vla-deploy crashes`: how processes ended that should not have."""

import argparse
import json
from pathlib import Path
from typing import Any

from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_top_command
from vla_deploy.runtime.state_dir import state_dir_of
from vla_deploy.supervisor.processes.crash_reports import crash_folder
from vla_deploy.supervisor.runs.runtime import default_base

EXAMPLES = """  vla-deploy crashes list
  vla-deploy crashes show 000003-perception
  vla-deploy crashes show --json           the newest one, as JSON
"""


def register(commands: Any) -> None:
    """Add the command."""
    crashes = add_top_command(commands, "crashes", EXAMPLES)
    crashes.add_argument("act", choices=("list", "show"), help="all in a line each, or one whole")
    crashes.add_argument("crash", nargs="?", help="its name in the list (default: the newest)")
    crashes.add_argument("--json", action="store_true", help="print JSON")
    crashes.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """List the reports, the newest last, or show one."""
    base = arguments.runtime_base or default_base()
    reports = {path.stem: path for path in crash_folder(state_dir_of(base)).entries()}
    if arguments.act == "show":
        report = _read(_chosen(reports, arguments.crash))
        print(json.dumps(report, indent=2) if arguments.json else as_text(report))
        return 0
    rows = [{"crash": name, **_read_or_why_not(path)} for name, path in reports.items()]
    if arguments.json:
        print(json.dumps(rows, indent=2))
    else:
        print("\n".join(_row(row) for row in rows) or "no process has crashed")
    return 0


def _chosen(reports: dict[str, Path], name: str | None) -> Path:
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


def _read_or_why_not(path: Path) -> dict[str, Any]:
    """Read a report; one that is not whole hides no other one."""
    try:
        return _read(path)
    except UsageError as error:
        return {"unreadable": str(error)}


def _row(report: dict[str, Any]) -> str:
    if "unreadable" in report:
        return f"{report['crash']:<24} unreadable: {report['unreadable']}"
    return f"{report['crash']:<24} {report['time']}  {report['reason']}"


def as_text(report: dict[str, Any]) -> str:
    """Return a report for a person."""
    ended = report["signal"] or f"exit code {report['exit_code']}"
    topics = [f"  {name}: {told['age_s']} s" for name, told in report["topics"].items()]
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
