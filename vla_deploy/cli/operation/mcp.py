"""`vla-deploy mcp`: serve AI agents by the Model Context Protocol; they may read and stop."""

import argparse
from typing import Any, Final

from vla_deploy.cli.commands import add_top_command, whole_number
from vla_deploy.cli.session import base_of

LAST_PORT: Final = 65_535
EXAMPLES: Final = """  vla-deploy mcp                       over stdio: an agent's program starts it
  vla-deploy mcp --http 8090           by HTTP on this computer, with a token (docs/agents.md)
  vla-deploy agent lease --minutes 10  what a person says before an agent may act
"""


def register(commands: Any) -> None:
    """Add the command."""
    mcp = add_top_command(commands, "mcp", EXAMPLES, run)
    mcp.add_argument("--http", type=_port, metavar="PORT", help="serve by HTTP instead of stdio")
    mcp.add_argument(
        "--host",
        default="127.0.0.1",
        help="serve at this loopback address (default: %(default)s)",
    )


def _port(text: str) -> int:
    port = whole_number()(text)
    if port > LAST_PORT:
        raise argparse.ArgumentTypeError(f"expected a port up to {LAST_PORT}, got {text!r}")
    return port


def run(arguments: argparse.Namespace) -> int:
    """Serve until the agent hangs up, or by HTTP until Ctrl-C."""
    from vla_deploy.gateways.mcp.serving import serve

    serve(base_of(arguments), (arguments.host, arguments.http) if arguments.http else None)
    return 0
