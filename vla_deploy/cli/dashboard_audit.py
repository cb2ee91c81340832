"""`vla-deploy dashboard audit`: who did what by the page, and by these commands."""

import argparse
import json
import os
import pwd
import sys
from pathlib import Path
from typing import Any

from drivers.clock import MonotonicClock
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_command
from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.supervisor.runtime import default_base


def register(acts: Any) -> None:
    """Add the act."""
    audit = add_command(
        acts, "audit", "tell who did what", "  vla-deploy dashboard audit --count 50\n"
    )
    audit.add_argument("--count", type=int, default=20, metavar="N", help="the last N (20)")
    audit.add_argument("--json", action="store_true", help="print JSON lines")
    audit.set_defaults(run=show_audit)


def show_audit(arguments: argparse.Namespace) -> int:
    """Print the last acts, the newest last.

    Raises:
        UsageError: the number is none.
        AuditUnusable: they cannot be read.
    """
    if arguments.count < 1:
        raise UsageError(f"--count {arguments.count}: expected at least 1")
    entries = reversed(_audit(arguments).newest(arguments.count))
    lines = [json.dumps(entry) if arguments.json else _line(entry) for entry in entries]
    for line in lines:
        sys.stdout.write(line + "\n")
    return 0


def _line(entry: dict[str, Any]) -> str:
    known = ("time", "user", "role", "way", "address", "act", "outcome", "code")
    rest = " ".join(json.dumps(value) for name, value in entry.items() if name not in known)
    code = f" ({entry['code']})" if "code" in entry else ""
    who = f"{entry['user']} from {entry['address']}"
    return f"{entry['time']} {entry['outcome']:<7} {entry['act']} by {who}{code} {rest}".rstrip()


def note(arguments: argparse.Namespace, act: str, **details: Any) -> None:
    """Tell the audit log, too: by the user of this computer."""
    user = pwd.getpwuid(os.getuid()).pw_name
    entry = AuditEntry(
        user=f"cli:{user}",
        role=UserRole.ADMIN,
        way="cli",
        address="terminal",
        act=f"dashboard {act}",
        outcome=AuditOutcome.DONE,
        details=details,
    )
    _audit(arguments).record(entry)


def base_of(arguments: argparse.Namespace) -> Path:
    """Return the runtime directory that is meant."""
    base: Path = arguments.runtime_base or default_base()
    return base


def _audit(arguments: argparse.Namespace) -> AuditLog:
    return AuditLog.of_base(base_of(arguments), MonotonicClock())
