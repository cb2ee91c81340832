"""`vla-deploy dashboard`: where the robot's page is, and who may use it."""

import argparse
import json
import sys
import webbrowser
from typing import Any

from vla_deploy.cli import dashboard_accounts, dashboard_audit, dashboard_tokens
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.example import add_top_command
from vla_deploy.cli.session import Session, attach

EXAMPLES = """  vla-deploy dashboard             print the page's address
  vla-deploy dashboard --open      open it in this computer's browser
  vla-deploy dashboard password    make the first admin's account; see also users, token, audit
  curl --unix-socket /run/vla-deploy/current/dashboard.sock http://robot/api/v1/state
"""
NAME = "dashboard"


def register(commands: Any) -> None:
    """Add the command."""
    dashboard = add_top_command(commands, NAME, EXAMPLES)
    dashboard.add_argument("--open", action="store_true", help="open the page in the browser")
    dashboard.add_argument("--json", action="store_true", help="print the addresses as JSON")
    dashboard.set_defaults(run=run)
    acts = dashboard.add_subparsers(dest="act", metavar="ACT")
    for module in (dashboard_accounts, dashboard_tokens, dashboard_audit):
        module.register(acts)


def run(arguments: argparse.Namespace) -> int:
    """Print where the page is, and where its stop door.

    Raises:
        CommandFailed: the dashboard does not answer, or no browser is found.
    """
    session = attach(arguments.runtime_base)
    told = session.document("dashboard_status", age_limit_s=3.0)
    if told is None:
        raise CommandFailed(f"the dashboard does not answer: {_why(session)}")
    if arguments.open and not webbrowser.open(told["url"]):
        raise CommandFailed(f"no browser is found on this computer; open {told['url']} elsewhere")
    sys.stdout.write((json.dumps(told, indent=2) if arguments.json else told["url"]) + "\n")
    return 0


def _why(session: Session) -> str:
    """Say what the supervisor knows of it."""
    table = session.document("process_table", age_limit_s=3.0) or {"processes": []}
    for row in table["processes"]:
        if row["name"] == NAME:
            reason = f" ({row['reason']})" if row["reason"] else ""
            return f"it is {row['state']}{reason}; see: vla-deploy logs {NAME}"
    return "it is not in the process table; see: vla-deploy status"
