"""`vla-deploy dashboard password | users`: who may log in."""

import argparse
import json
import sys
from datetime import UTC, datetime
from typing import Any, Final

from vla_deploy.cli.dashboard_audit import base_of, note
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_command
from vla_deploy.client.access.accounts import Accounts, AccountsFile, User, UserRole, wall_s
from vla_deploy.client.access.passwords import LONGEST, SHORTEST, generate_password, hash_password

ROLES: Final = tuple(role.value for role in UserRole if role is not UserRole.ANYONE)
_FIRST_USER: Final = "admin"


def register(acts: Any) -> None:
    """Add the acts."""
    password = add_command(
        acts,
        "password",
        "make an account, or give one a new password; it is shown once",
        "  vla-deploy dashboard password                       the first admin's\n"
        "  vla-deploy dashboard password ann --role operator\n",
    )
    password.add_argument("user", nargs="?", default=_FIRST_USER, help=f"({_FIRST_USER})")
    password.add_argument("--role", choices=ROLES, help="(a new account: admin)")
    password.add_argument(
        "--stdin", action="store_true", help="take a password of your own from standard input"
    )
    password.set_defaults(run=set_password)
    users = add_command(
        acts, "users", "list the accounts, or remove one", "  vla-deploy dashboard users\n"
    )
    users.add_argument("--remove", metavar="USER", help="whose account to remove")
    users.add_argument("--json", action="store_true", help="print JSON")
    users.set_defaults(run=list_users)


def set_password(arguments: argparse.Namespace) -> int:
    """Store a new password's hash; print the password where it was generated here.

    Raises:
        UsageError: the given password is too short or too long.
        AccountRefused: the name is none.
    """
    password = _given() if arguments.stdin else generate_password()
    stored = hash_password(password)

    def change(held: Accounts) -> tuple[Accounts, UserRole]:
        known = held.users.get(arguments.user)
        role = (
            UserRole(arguments.role) if arguments.role else known.role if known else UserRole.ADMIN
        )
        user = User(role=role, password=stored, changed_s=wall_s())
        return held.with_user(arguments.user, user), role

    role = accounts_of(arguments).change(change)
    note(arguments, "password", name=arguments.user, role=role)
    if arguments.stdin:
        return tell(f"{arguments.user} ({role}) has a new password")
    print(f"{arguments.user} ({role}); this is shown once:", file=sys.stderr)
    return tell(password)


def list_users(arguments: argparse.Namespace) -> int:
    """Print every account, or remove one.

    Raises:
        AccountRefused: there is none of that name.
    """
    file = accounts_of(arguments)
    if arguments.remove:
        file.change(lambda held: (held.without_user(arguments.remove), None))
        note(arguments, "remove user", name=arguments.remove)
        return tell(f"{arguments.remove} may no longer log in")
    users = file.read().users
    rows = [
        {"user": name, "role": str(user.role), "password_of": date(user.changed_s)}
        for name, user in sorted(users.items())
    ]
    return table(arguments.json, rows, "no account: vla-deploy dashboard password")


def _given() -> str:
    password = sys.stdin.readline(LONGEST + 2).rstrip("\n")
    if not SHORTEST <= len(password) <= LONGEST:
        raise UsageError(
            f"expected a password of {SHORTEST} to {LONGEST} characters on standard input, got "
            f"{len(password)}"
        )
    return password


def accounts_of(arguments: argparse.Namespace) -> AccountsFile:
    """Return the file of accounts."""
    return AccountsFile.of_base(base_of(arguments))


def table(as_json: bool, rows: list[dict[str, str]], nothing: str) -> int:
    """Print rows for a person or for a program."""
    if as_json:
        return tell(json.dumps(rows, indent=2))
    if not rows:
        return tell(nothing)
    lines = [list(rows[0]), *(list(row.values()) for row in rows)]
    return tell("\n".join("  ".join(f"{word:<18}" for word in line).rstrip() for line in lines))


def date(wall_clock_s: float) -> str:
    """Return a time of the wall clock for a person."""
    return datetime.fromtimestamp(wall_clock_s, UTC).isoformat(timespec="minutes")


def tell(text: str) -> int:
    """Print a text; return the exit code of success."""
    sys.stdout.write(text + "\n")
    return 0
