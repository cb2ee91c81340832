"""`vla-deploy agent lease | revoke | status`: let AI agents command the robot for a while."""

import argparse
import os
import pwd
from collections.abc import Callable
from typing import Any, Final

from vla_deploy.cli.commands import add_command, add_top_command, emit, number_within
from vla_deploy.cli.session import attach
from vla_deploy.client.access.accounts import UserRole
from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.client.agent_lease import LONGEST_MINUTES, LeaseKeeper, LeaseState

LEAST_MINUTES: Final = 0.1
EXAMPLES: Final = """  vla-deploy agent lease --minutes 10
  vla-deploy agent status
  vla-deploy agent revoke        what agents have asked for ends, the robot comes to rest
"""


def register(commands: Any) -> None:
    """Add the command."""
    agent = add_top_command(commands, "agent", EXAMPLES)
    acts = agent.add_subparsers(dest="act", required=True, metavar="ACT")
    lease, *_ = (
        add_command(acts, name, summary, EXAMPLES, run, json_help="print the lease as JSON")
        for name, summary in (
            ("lease", "let agents give commands for some minutes"),
            ("revoke", "take the lease back, and end what agents have asked for"),
            ("status", "say whether agents may give commands, and for how long yet"),
        )
    )
    lease.add_argument(
        "--minutes",
        type=number_within(
            LEAST_MINUTES,
            LONGEST_MINUTES,
            f"minutes from {LEAST_MINUTES:g} to {LONGEST_MINUTES}",
        ),
        default=10.0,
        help=f"for how long, at most {LONGEST_MINUTES} (default: 10)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Grant the lease, take it back, or only print how it stands."""
    session = attach(arguments.runtime_base)
    desk = LeaseKeeper(session.space, session.clock)
    by = f"cli:{pwd.getpwuid(os.getuid()).pw_name}"
    acts: dict[str, Callable[[], LeaseState]] = {
        "lease": lambda: desk.grant(by, arguments.minutes),
        "revoke": lambda: desk.revoke(by),
        "status": desk.state,
    }
    state = acts[arguments.act]()
    if arguments.act != "status":
        entry = AuditEntry(
            user=by,
            role=UserRole.ADMIN,
            way="cli",
            address="terminal",
            act=f"agent {arguments.act}",
            outcome=AuditOutcome.DONE,
            details={"minutes": arguments.minutes} if arguments.act == "lease" else {},
        )
        AuditLog.of_base(session.base, session.clock).record(entry)
    return emit(arguments, state.document(), lambda: as_text(state))


def as_text(state: LeaseState) -> str:
    """Return how the lease stands in a line."""
    if not state.is_live:
        return f"agents may read and stop, no more: {state.refusal}"
    minutes, seconds = divmod(round(state.left_s), 60)
    return (
        f"agents may give commands for {minutes} min {seconds} s, by leave of {state.granted_by}; "
        "take it back: vla-deploy agent revoke"
    )
