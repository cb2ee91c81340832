"""`vla-deploy validate`: campaigns that look for what must never happen, judged by physics."""

import argparse
import math
import os
import sys
from pathlib import Path
from typing import Any

from vla_deploy.cli.example import add_top_command

# Started by name: the robot's code never imports the twin.
CAMPAIGNS = {
    "faults": "every fault in every phase of the work, on the lock-step twin",
    "kills": "kill -9, SIGSTOP and SIGTERM of every process at random moments",
    "load": "the main job again and again beside eight busy loops: only its duration may change",
    "pressure": "too little memory, CPU, disk, cooling or power, and a clock that jumps",
    "switches": "hot profile switches under motion, and bad profiles",
    "soak": "hours of work in lock-step: memory, files and threads must not grow",
}
EXAMPLES = """  vla-deploy validate faults --only servo_bus --json
  vla-deploy validate kills --count 20 --junit out/kills.xml
"""
_PASSED_ON = ("only", "count", "hours", "seed", "workers", "junit")


def register(commands: Any) -> None:
    """Add the command."""
    validate = add_top_command(commands, "validate", EXAMPLES)
    listed = "; ".join(f"{name}: {summary}" for name, summary in CAMPAIGNS.items())
    validate.add_argument("campaign", choices=tuple(CAMPAIGNS), help=listed)
    validate.add_argument("--only", metavar="TEXT", help="only cases whose name contains this")
    validate.add_argument("--count", type=whole_number, help="how many injections or switches")
    validate.add_argument("--hours", type=duration_h, help="how long to soak (default: 1)")
    validate.add_argument("--seed", type=int, help="of the random moments (default: 0)")
    validate.add_argument(
        "--workers", type=whole_number, help="how many cases at a time (default: 2)"
    )
    validate.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    validate.add_argument("--json", action="store_true", help="print the report as JSON")
    validate.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Become the process of a campaign, so that a signal meets it; exit code 1: a case failed."""
    command = [sys.executable, "-m", "sim_twin.campaigns", arguments.campaign]
    for name in _PASSED_ON:
        value = vars(arguments)[name]
        if value is not None:
            command += [f"--{name}", str(value)]
    if arguments.json:
        command.append("--json")
    os.execv(sys.executable, command)


def whole_number(text: str) -> int:
    """Return a count.

    Raises:
        argparse.ArgumentTypeError: it is no whole number from 1.
    """
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got {text!r}")
    return int(text)


def duration_h(text: str) -> float:
    """Return for how many hours.

    Raises:
        argparse.ArgumentTypeError: it is no finite number above 0.
    """
    try:
        hours = float(text)
    except ValueError:
        hours = math.nan
    if not 0.0 < hours < math.inf:
        raise argparse.ArgumentTypeError(f"expected hours above 0, got {text!r}")
    return hours
