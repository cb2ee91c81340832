"""Read the command line and run one command."""

import argparse
import itertools
import os
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

from vla_deploy.cli.commands import COMMANDS, OneLineParser
from vla_deploy.cli.errors import CommandFailed, user_errors
from vla_deploy.cli.terminal import escaping_output

EXIT_BROKEN_PIPE = 141  # a shell's exit code for SIGPIPE
# systemd restarts the service after 1, never after 2; a full disk may have room again later.
EXIT_OF_OS_ERROR = {"run": 1}
EPILOG = """examples:
  vla-deploy demo                                 pick and place on the twin
  vla-deploy run --twin                           keep a twin running
  vla-deploy say "go to the kitchen"              in another terminal
"""


def parser(words: Iterable[str] = tuple(COMMANDS)) -> argparse.ArgumentParser:
    """Return a parser: with arguments for the commands in `words`, with summaries for others."""
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
    with escaping_output():
        return _main(sys.argv[1:] if argv is None else argv)


def _main(words: Sequence[str]) -> int:
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
    except BrokenPipeError:  # the reader, such as head, has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE
    except OSError as error:
        print(f"vla-deploy: {_reason(error)}", file=sys.stderr)
        return EXIT_OF_OS_ERROR.get(arguments.command, 2)


def _reason(error: OSError) -> str:
    """Return in one line which file could not be used, and why."""
    if error.filename is None or not error.strerror:
        return str(error) or type(error).__name__
    return f"{os.fsdecode(error.filename)}: {error.strerror}"


if __name__ == "__main__":
    sys.exit(main())
