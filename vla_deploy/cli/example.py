"""Give every command a help text with an example, and every bad argument one line."""

import argparse
from typing import Any, NoReturn

from vla_deploy.cli.commands import COMMANDS


class OneLineParser(argparse.ArgumentParser):
    """Say in one line what is wrong with the arguments; its commands do the same."""

    def error(self, message: str) -> NoReturn:
        """Exit with code 2."""
        self.exit(2, f"{self.prog}: {message}; see: {self.prog} --help\n")


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


def add_top_command(commands: Any, name: str, examples: str) -> argparse.ArgumentParser:
    """Add one of `COMMANDS`, which says what it is for."""
    return add_command(commands, name, COMMANDS[name].summary, examples)
