"""`vla-deploy dashboard`: where the robot's page is, who may use it, and who did what by it."""

import argparse
import json
import os
import pwd
import sys
import webbrowser
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from vla_deploy.cli.commands import Run, add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import RobotSession, attach, base_of
from vla_deploy.client.access.accounts import (
    Accounts,
    AccountsFile,
    User,
    UserRole,
    new_token,
    wall_s,
)
from vla_deploy.client.access.audit_log import AuditEntry, AuditLog, AuditOutcome
from vla_deploy.client.access.login_link import login_url
from vla_deploy.client.access.passwords import LONGEST, SHORTEST, generate_password, hash_password
from vla_deploy.client.access.private_file import open_private
from vla_deploy.ipc import topics

EXAMPLES = """  vla-deploy dashboard             print a link that logs one browser in, once
  vla-deploy dashboard --open      open it in this computer's browser
  vla-deploy dashboard password    make the first admin's account; see also users, token, audit
  curl --unix-socket /run/vla-deploy/current/dashboard.sock http://robot/api/v1/state
"""
NAME: Final = "dashboard"
ROLES: Final = tuple(role.value for role in UserRole if role is not UserRole.ANYONE)
_LOGIN_PAGE: Final = "login.html"
_FIRST_USER: Final = "admin"
_DAY_S: Final = 86_400.0
_MAX_DAYS: Final = 3650
_STATUS_AGE_S: Final = 3.0


def register(commands: Any) -> None:
    """Add the command."""
    dashboard = add_top_command(
        commands, NAME, EXAMPLES, show_address, json_help="print the addresses as JSON"
    )
    dashboard.add_argument("--open", action="store_true", help="open the page in the browser")
    acts = dashboard.add_subparsers(dest="act", metavar="ACT")
    register_acts(acts)


def register_acts(acts: Any) -> None:
    """Add the acts on accounts, tokens and the audit log."""
    password = _add(
        acts,
        "password",
        "make an account, or give one a new password; it is shown once",
        set_password,
        "password                       the first admin's",
        "password ann --role operator",
    )
    password.add_argument("user", nargs="?", default=_FIRST_USER, help=f"({_FIRST_USER})")
    password.add_argument("--role", choices=ROLES, help="(a new account: admin)")
    password.add_argument(
        "--stdin", action="store_true", help="take a password of your own from standard input"
    )
    users = _add(
        acts,
        "users",
        "list the accounts, or remove one",
        list_users,
        "users",
        json_help="print JSON",
    )
    users.add_argument("--remove", metavar="USER", help="whose account to remove")
    _register_token_acts(acts)
    audit = _add(
        acts,
        "audit",
        "show who did what",
        show_audit,
        "audit --count 50",
        json_help="print JSON lines",
    )
    audit.add_argument("--count", type=int, default=20, metavar="N", help="the last N (20)")


def _register_token_acts(acts: Any) -> None:
    token = _add(acts, "token", "make, list and revoke tokens", None, "token list")
    token_acts = token.add_subparsers(dest="token_act", required=True, metavar="ACT")
    add = _add(
        token_acts,
        "add",
        "make a token for a program; it is shown once",
        add_token,
        "token add prometheus --role viewer --days 365",
    )
    add.add_argument("name", metavar="NAME", help="what it is for")
    add.add_argument("--role", choices=ROLES, required=True)
    add.add_argument("--days", type=float, metavar="N", help="how long it is valid (for ever)")
    _add(
        token_acts,
        "list",
        "list the tokens",
        list_tokens,
        "token list --json",
        json_help="print JSON",
    )
    revoke = _add(
        token_acts,
        "revoke",
        "make a token invalid, at once",
        revoke_token,
        "token revoke prometheus",
    )
    revoke.add_argument("name", metavar="NAME")


def _add(
    acts: Any, name: str, summary: str, run: Run | None, *examples: str, json_help: str = ""
) -> argparse.ArgumentParser:
    text = "".join(f"  vla-deploy dashboard {one}\n" for one in examples)
    return add_command(acts, name, summary, text, run, json_help)


def show_address(arguments: argparse.Namespace) -> int:
    """Print the address of the page, as a link that logs one browser in once.

    Raises:
        CommandFailed: the dashboard does not answer, or no browser is found.
        LoginLinkUnavailable: it runs for another user.
    """
    session = attach(arguments.runtime_base)
    status = session.document(topics.DASHBOARD_STATUS, age_limit_s=_STATUS_AGE_S)
    if status is None:
        raise CommandFailed(f"the dashboard does not answer: {_why_silent(session)}")
    link = login_url(session.run_dir, status["url"])
    if arguments.open and not webbrowser.open(_private_page(session.run_dir, link)):
        raise CommandFailed(f"no browser is found on this computer; open {link} elsewhere")
    return emit(arguments, {**status, "login_url": link}, link)


def _private_page(run_dir: Path, link: str) -> str:
    """Return the address of a file that leads to a link.

    Every user of this computer sees the words that a browser is started with.
    """
    page = run_dir / _LOGIN_PAGE
    page.unlink(missing_ok=True)
    handle = open_private(page, os.O_WRONLY | os.O_EXCL)
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(f'<meta http-equiv="refresh" content="0; url={link}">\n')
    return page.resolve().as_uri()


def _why_silent(session: RobotSession) -> str:
    """Return the supervisor's state of the dashboard in words."""
    table = session.document(topics.PROCESS_TABLE, age_limit_s=_STATUS_AGE_S)
    for row in () if table is None else table["processes"]:
        if row["name"] == NAME:
            reason = f" ({row['reason']})" if row["reason"] else ""
            return f"it is {row['state']}{reason}; see: vla-deploy logs {NAME}"
    return "it is not in the process table; see: vla-deploy status"


def set_password(arguments: argparse.Namespace) -> int:
    """Store a new password's hash; print the password where it was generated here.

    Raises:
        UsageError: the given password is too short or too long.
        AccountRefused: the name is not allowed.
    """
    password = _password_from_stdin() if arguments.stdin else generate_password()
    stored = hash_password(password)

    def change(held: Accounts) -> tuple[Accounts, UserRole]:
        known = held.users.get(arguments.user)
        role = (
            UserRole(arguments.role) if arguments.role else known.role if known else UserRole.ADMIN
        )
        user = User(role=role, password=stored, changed_s=wall_s())
        return held.with_user(arguments.user, user), role

    role = _accounts_file(arguments).change(change)
    _log(arguments, "password", name=arguments.user, role=role)
    if arguments.stdin:
        print(f"{arguments.user} ({role}) has a new password")
    else:
        print(f"{arguments.user} ({role}); this is shown once:", file=sys.stderr)
        print(password)
    return 0


def _password_from_stdin() -> str:
    password = sys.stdin.readline(LONGEST + 2).rstrip("\n")
    if not SHORTEST <= len(password) <= LONGEST:
        raise UsageError(
            f"expected a password of {SHORTEST} to {LONGEST} characters on standard input, got "
            f"{len(password)}"
        )
    return password


def list_users(arguments: argparse.Namespace) -> int:
    """Print every account, or remove one.

    Raises:
        AccountRefused: there is none of that name.
    """
    file = _accounts_file(arguments)
    if arguments.remove:
        file.change(lambda held: (held.without_user(arguments.remove), None))
        _log(arguments, "remove user", name=arguments.remove)
        print(f"{arguments.remove} may no longer log in")
        return 0
    users = file.read().users
    rows = [
        {"user": name, "role": str(user.role), "password_of": _date(user.changed_s)}
        for name, user in sorted(users.items())
    ]
    return emit(arguments, rows, _table(rows) or "no account: vla-deploy dashboard password")


def add_token(arguments: argparse.Namespace) -> int:
    """Make a token, store its hash, and print it.

    Raises:
        UsageError: it would be valid for no time, or for too long.
        AccountRefused: its name is taken or not allowed.
    """
    days = arguments.days
    if days is not None and not 0.0 < days <= _MAX_DAYS:
        raise UsageError(f"--days {days:g}: expected more than 0, at most {_MAX_DAYS}")
    lasts_s = None if days is None else days * _DAY_S
    token_id, text, token = new_token(arguments.name, UserRole(arguments.role), wall_s(), lasts_s)
    _accounts_file(arguments).change(lambda held: (held.with_token(token_id, token), None))
    _log(arguments, "token add", name=arguments.name, role=arguments.role, days=days or "for ever")
    print(f"token {arguments.name} ({arguments.role}); this is shown once:", file=sys.stderr)
    print(text)
    return 0


def list_tokens(arguments: argparse.Namespace) -> int:
    """Print every token without its secret, which is stored nowhere."""
    tokens = _accounts_file(arguments).read().tokens.values()
    rows = [
        {
            "token": token.name,
            "role": str(token.role),
            "made": _date(token.made_s),
            "expires": "never" if token.expires_s is None else _date(token.expires_s),
        }
        for token in sorted(tokens, key=lambda one: one.name)
    ]
    nothing = "no token: vla-deploy dashboard token add NAME --role ROLE"
    return emit(arguments, rows, _table(rows) or nothing)


def revoke_token(arguments: argparse.Namespace) -> int:
    """Delete a token's hash.

    Raises:
        AccountRefused: there is none of that name.
    """
    _accounts_file(arguments).change(lambda held: (held.without_token(arguments.name), None))
    _log(arguments, "token revoke", name=arguments.name)
    print(f"token {arguments.name} counts no more")
    return 0


def show_audit(arguments: argparse.Namespace) -> int:
    """Print the last entries of the audit log, the newest last.

    Raises:
        UsageError: the count is below 1.
        AuditUnusable: the log cannot be read.
    """
    if arguments.count < 1:
        raise UsageError(f"--count {arguments.count}: expected at least 1")
    for entry in reversed(_audit_log(arguments).newest(arguments.count)):
        print(json.dumps(entry) if arguments.json else _audit_line(entry))
    return 0


def _audit_line(entry: dict[str, Any]) -> str:
    known = ("time", "user", "role", "way", "address", "act", "outcome", "code")
    rest = " ".join(json.dumps(value) for name, value in entry.items() if name not in known)
    code = f" ({entry['code']})" if "code" in entry else ""
    who = f"{entry['user']} from {entry['address']}"
    return f"{entry['time']} {entry['outcome']:<7} {entry['act']} by {who}{code} {rest}".rstrip()


def _log(arguments: argparse.Namespace, act: str, **details: Any) -> None:
    """Write an act of this computer's user into the audit log."""
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
    _audit_log(arguments).record(entry)


def _audit_log(arguments: argparse.Namespace) -> AuditLog:
    return AuditLog.of_base(base_of(arguments), MonotonicClock())


def _accounts_file(arguments: argparse.Namespace) -> AccountsFile:
    return AccountsFile.of_base(base_of(arguments))


def _table(rows: list[dict[str, str]]) -> str:
    lines = [list(rows[0]), *(list(row.values()) for row in rows)] if rows else []
    return "\n".join("  ".join(f"{word:<18}" for word in line).rstrip() for line in lines)


def _date(wall_clock_s: float) -> str:
    return datetime.fromtimestamp(wall_clock_s, UTC).isoformat(timespec="minutes")
