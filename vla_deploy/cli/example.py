"""Give every command a help text with an example."""

import argparse
from typing import Any


def add_command(
    commands: Any, name: str, summary: str, examples: str, aliases: tuple[str, ...] = ()
) -> argparse.ArgumentParser:
    """Add one command whose `--help` ends with examples."""
    added: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=summary[0].upper() + summary[1:] + ".",
        epilog=f"examples:\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        aliases=list(aliases),
    )
    return added
