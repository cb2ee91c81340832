"""Read the command line and run one command."""

import argparse
import itertools
import os
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

from vla_deploy.cli.commands import COMMANDS
from vla_deploy.cli.errors import CommandFailed, user_errors
from vla_deploy.cli.example import OneLineParser

EXIT_BROKEN_PIPE = 141  # as a shell tells the end by SIGPIPE
# The service is started anew after 1, never after 2; a disk that was full may have room again.
EXIT_OF_OS_ERROR = {"run": 1}
EPILOG = """examples:
  vla-deploy demo                                 pick and place on the twin
  vla-deploy run --twin                           keep a twin running
  vla-deploy say "go to the kitchen"              in another terminal
"""


def parser(words: Iterable[str] = tuple(COMMANDS)) -> argparse.ArgumentParser:
    """Return the parser of the commands among `words`; of the others it knows what they are for."""
    top = OneLineParser(
        prog="vla-deploy",
        description="Run a language-commanded robot, or its digital twin.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument(
        "--runtime-base",
        type=Path,
        metavar="DIR",
        help="where runs live (default: /run/vla-deploy for root, else XDG_RUNTIME_DIR)",
    )
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    wanted = {COMMANDS[word].module for word in words if word in COMMANDS}
    for module, members in itertools.groupby(COMMANDS, lambda name: COMMANDS[name].module):
        if module in wanted:
            import_module(f"vla_deploy.cli.{module}").register(commands)
            continue
        for name in members:
            commands.add_parser(name, help=COMMANDS[name].summary)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return 0 on success, 1 when the robot failed, 2 for a bad request."""
    words = sys.argv[1:] if argv is None else argv
    arguments = parser(words).parse_args(words)
    try:
        code = int(arguments.run(arguments))
        sys.stdout.flush()
        return code
    except CommandFailed as error:
        print(f"vla-deploy: {error}", file=sys.stderr)
        return 1
    except user_errors() as error:
        print(f"vla-deploy: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # whoever reads, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE
    except OSError as error:
        print(f"vla-deploy: {_told(error)}", file=sys.stderr)
        return EXIT_OF_OS_ERROR.get(arguments.command, 2)


def _told(error: OSError) -> str:
    """Return which file could not be used and why, in one line."""
    if error.filename is None or not error.strerror:
        return str(error) or type(error).__name__
    return f"{os.fsdecode(error.filename)}: {error.strerror}"


if __name__ == "__main__":
    sys.exit(main())
