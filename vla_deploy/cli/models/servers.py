"""`vla-deploy servers`: see and try the model servers that the robot may ask."""

import argparse
from typing import Any

from drivers.clock import MonotonicClock
from vla_deploy.cli.commands import add_command, add_top_command, emit
from vla_deploy.cli.session import base_of
from vla_deploy.model_servers.checking import ServerCheck, check_server
from vla_deploy.model_servers.credentials import find_credential
from vla_deploy.model_servers.errors import CredentialMissing
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.model_servers.shelf import ServerShelf

EXAMPLES = """  vla-deploy servers list
  vla-deploy servers check                 reachable, how fast, has it the model, does it see
  vla-deploy servers check bench --ask     also ask its model something
"""


def register(commands: Any) -> None:
    """Add the command."""
    servers = add_top_command(commands, "servers", EXAMPLES)
    acts = servers.add_subparsers(dest="act", required=True, metavar="ACT")
    add_command(
        acts,
        "list",
        "list the declared servers, and which data may be sent to each",
        "  vla-deploy servers list --json\n",
        list_servers,
        json_help="print JSON",
    )
    check = add_command(
        acts,
        "check",
        "try servers; 1 where one of them fails",
        "  vla-deploy servers check bench --ask --json\n",
        check_servers,
        json_help="print JSON",
    )
    check.add_argument("names", nargs="*", metavar="NAME", help="which ones (default: all)")
    check.add_argument(
        "--ask", action="store_true", help="ask the model something, about a red card if it sees"
    )


def list_servers(arguments: argparse.Namespace) -> int:
    """Print every declared server."""
    shelf = _shelf(arguments)
    rows = [_row(shelf, name, settings) for name, settings in shelf.declared.items()]
    head = f"{'server':<14} {'api':<18} {'model':<24} {'may be told':<14} {'key':<8} url"
    lines = [
        f"{row['name']:<14} {row['api']:<18} {row['model']:<24} {row['may_be_told']:<14} "
        f"{row['key']:<8} {row['url']}"
        for row in rows
    ]
    text = "\n".join([head, *lines]) if rows else f"no server is declared in {shelf.file}"
    return emit(arguments, {"file": str(shelf.file), "servers": rows}, text)


def check_servers(arguments: argparse.Namespace) -> int:
    """Try servers; return 1 when one of them fails."""
    shelf = _shelf(arguments)
    unknown = sorted(set(arguments.names) - shelf.declared.keys())
    if unknown:
        shelf.open(unknown[0])  # raises, and names those that are declared
    checks = [_check(shelf, name, arguments.ask) for name in arguments.names or shelf.declared]
    text = "\n".join(map(_line, checks)) or f"no server is declared in {shelf.file}"
    emit(arguments, [check.document() for check in checks], text)
    return 0 if all(check.is_ok for check in checks) else 1


def _shelf(arguments: argparse.Namespace) -> ServerShelf:
    return ServerShelf.of_base(base_of(arguments), MonotonicClock())


def _check(shelf: ServerShelf, name: str, ask: bool) -> ServerCheck:
    try:
        return check_server(shelf.open(name), ask)
    except CredentialMissing as error:
        return ServerCheck(server=name, is_reachable=False, detail=str(error))


def _row(shelf: ServerShelf, name: str, settings: ServerSettings) -> dict[str, Any]:
    return {
        "name": name,
        "api": str(settings.api),
        "url": settings.url,
        "model": settings.model,
        "location": str(settings.location),
        "vision": settings.vision,
        "may_be_told": _may_be_told(settings),
        "key": _key(shelf, settings),
    }


def _may_be_told(settings: ServerSettings) -> str:
    text = settings.is_local or settings.allow_text_off_robot
    images = settings.vision and (settings.is_local or settings.allow_images_off_robot)
    allowed = [what for what, may in (("text", text), ("images", images)) if may]
    return " ".join(allowed) or "nothing"


def _key(shelf: ServerShelf, settings: ServerSettings) -> str:
    if settings.credential is None:
        return "none"
    try:
        find_credential(settings.credential, shelf.key_folders)
    except CredentialMissing:
        return "missing"
    return "found"


def _line(check: ServerCheck) -> str:
    if not check.is_reachable:
        return f"FAIL {check.server}: {check.detail}"
    facts = {
        "has the model": check.has_model,
        "says that it sees": check.says_vision,
        "answers": check.answers,
        "sees": check.sees,
    }
    words = [
        text if is_so else f"not: {text}" for text, is_so in facts.items() if is_so is not None
    ]
    times = [f"reached in {1000 * (check.latency_s or 0.0):.0f} ms"]
    if check.answer_s is not None:
        times.append(f"answered in {check.answer_s:.2f} s by {check.asked_by}")
    detail = f" ({check.detail})" if check.detail else ""
    return f"{'ok  ' if check.is_ok else 'FAIL'} {check.server}: {', '.join(times + words)}{detail}"
