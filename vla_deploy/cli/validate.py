"""`vla-deploy validate`: campaigns that look for what must never happen, judged by physics."""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

from vla_deploy.cli.example import add_top_command

# Started by name: the robot's code never imports the twin.
CAMPAIGNS = {
    "faults": "every fault in every phase of the work, on the lock-step twin",
    "kills": "kill -9, SIGSTOP and SIGTERM of every process at random moments",
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
    validate.add_argument("--count", type=int, help="how many injections or switches")
    validate.add_argument("--hours", type=float, help="how long to soak (default: 1)")
    validate.add_argument("--seed", type=int, help="of the random moments (default: 0)")
    validate.add_argument("--workers", type=int, help="how many cases at a time (default: 2)")
    validate.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    validate.add_argument("--json", action="store_true", help="print the report as JSON")
    validate.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run one campaign in a process of its own; exit code 1 when a case failed."""
    command = [sys.executable, "-m", "sim_twin.campaigns", arguments.campaign]
    for name in _PASSED_ON:
        value = vars(arguments)[name]
        if value is not None:
            command += [f"--{name}", str(value)]
    if arguments.json:
        command.append("--json")
    return subprocess.run(command, check=False).returncode
