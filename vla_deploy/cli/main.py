"""Read the command line and run one command."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from vla_deploy.cli import (
    bench,
    budget,
    can,
    check,
    crashes,
    demo,
    doctor,
    fault,
    flight,
    install,
    logs,
    operate,
    profile,
    release,
    run,
    say,
    servo,
    status,
    validate,
)
from vla_deploy.cli.errors import USER_ERRORS, CommandFailed
from vla_deploy.cli.example import OneLineParser

COMMANDS = (
    run,
    demo,
    say,
    status,
    budget,
    logs,
    crashes,
    operate,
    profile,
    servo,
    can,
    fault,
    flight,
    check,
    doctor,
    bench,
    validate,
    install,
    release,
)
EXIT_BROKEN_PIPE = 141  # as a shell tells the end by SIGPIPE
EPILOG = """examples:
  vla-deploy demo                                 pick and place on the twin
  vla-deploy run --twin                           keep a twin running
  vla-deploy say "go to the kitchen"              in another terminal
"""


def parser() -> argparse.ArgumentParser:
    """Return the parser of every command."""
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
    for command in COMMANDS:
        command.register(commands)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; return 0 on success, 1 when the robot failed, 2 for a bad request."""
    arguments = parser().parse_args(argv)
    try:
        code = int(arguments.run(arguments))
        sys.stdout.flush()
        return code
    except CommandFailed as error:
        print(f"vla-deploy: {error}", file=sys.stderr)
        return 1
    except USER_ERRORS as error:
        print(f"vla-deploy: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:  # whoever reads, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE


if __name__ == "__main__":
    sys.exit(main())
