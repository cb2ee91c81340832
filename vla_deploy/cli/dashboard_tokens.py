"""`vla-deploy dashboard token`: let programs in, for a time."""

import argparse
import sys
from typing import Any, Final

from vla_deploy.cli.dashboard_accounts import ROLES, accounts_of, date, table, tell
from vla_deploy.cli.dashboard_audit import note
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.example import add_command
from vla_deploy.client.access.accounts import UserRole, new_token, wall_s

_DAY_S: Final = 86_400.0
_MOST_DAYS: Final = 3650


def register(acts: Any) -> None:
    """Add the acts."""
    token = add_command(
        acts, "token", "make, list and revoke tokens", "  vla-deploy dashboard token list\n"
    )
    token_acts = token.add_subparsers(dest="token_act", required=True, metavar="ACT")
    add = add_command(
        token_acts,
        "add",
        "make a token for a program; it is shown once",
        "  vla-deploy dashboard token add prometheus --role viewer --days 365\n",
    )
    add.add_argument("name", metavar="NAME", help="what it is for")
    add.add_argument("--role", choices=ROLES, required=True)
    add.add_argument("--days", type=float, metavar="N", help="how long it counts (for ever)")
    add.set_defaults(run=add_token)
    listing = add_command(
        token_acts, "list", "list the tokens", "  vla-deploy dashboard token list --json\n"
    )
    listing.add_argument("--json", action="store_true", help="print JSON")
    listing.set_defaults(run=list_tokens)
    revoke = add_command(
        token_acts,
        "revoke",
        "have a token count no more, at once",
        "  vla-deploy dashboard token revoke prometheus\n",
    )
    revoke.add_argument("name", metavar="NAME")
    revoke.set_defaults(run=revoke_token)


def add_token(arguments: argparse.Namespace) -> int:
    """Make a token, store its hash, and print it.

    Raises:
        UsageError: it would count for no time, or for too long.
        AccountRefused: another has its name, or it is no name.
    """
    days = arguments.days
    if days is not None and not 0.0 < days <= _MOST_DAYS:
        raise UsageError(f"--days {days:g}: expected more than 0, at most {_MOST_DAYS}")
    lasts_s = None if days is None else days * _DAY_S
    token_id, text, token = new_token(arguments.name, UserRole(arguments.role), wall_s(), lasts_s)
    accounts_of(arguments).change(lambda held: (held.with_token(token_id, token), None))
    note(arguments, "token add", name=arguments.name, role=arguments.role, days=days or "for ever")
    print(f"token {arguments.name} ({arguments.role}); this is shown once:", file=sys.stderr)
    return tell(text)


def list_tokens(arguments: argparse.Namespace) -> int:
    """Print every token but its secret, which is stored nowhere."""
    rows = [
        {
            "token": token.name,
            "role": str(token.role),
            "made": date(token.made_s),
            "expires": "never" if token.expires_s is None else date(token.expires_s),
        }
        for token in sorted(accounts_of(arguments).read().tokens.values(), key=lambda one: one.name)
    ]
    return table(arguments.json, rows, "no token: vla-deploy dashboard token add NAME --role ROLE")


def revoke_token(arguments: argparse.Namespace) -> int:
    """Forget a token's hash.

    Raises:
        AccountRefused: there is none of that name.
    """
    accounts_of(arguments).change(lambda held: (held.without_token(arguments.name), None))
    note(arguments, "token revoke", name=arguments.name)
    return tell(f"token {arguments.name} counts no more")
