"""`vla-deploy bench`: measure beside a peer or a limit, in the same run."""

import argparse
import subprocess
import sys
from typing import Any

from vla_deploy.cli.example import add_top_command

# Started by name: the robot's code never imports the benchmarks.
BENCHMARKS = {
    "bus": "16-servo cycle against dynamixel-sdk on the same emulated bus",
    "contact": "torque that no contact explains while the robot works, against its limits",
    "control": "CPU time of a control tick by stage: at rest, driving, arms moving",
    "dashboard": "what clients cost control, one of them frozen; its stop to the wire; --part",
    "estop": "emergency stop: from the request to the wire under load, and to standstill",
    "perception": "how well, how fast and at what cost the robot sees; int8 beside fp32; --part",
    "planner": "commands understood, other talk left alone, attacks refused, time to plan; --part",
    "recorder": "what the flight recorder costs: per control tick, per look, per flight",
    "ros": "the ROS gateway: its share of a core, its latency, late ticks with and without it",
    "serial": "a serial port's bytes on busy cores, with the kernel's workers raised and not",
    "speech": "words understood by voice and noise, from speech to text, what it costs; --part",
    "ticks": "late control ticks, idle and under load, with and without SCHED_FIFO",
    "twin": "twin steps against raw mj_step, and the lock-step real-time factor",
}


def register(commands: Any) -> None:
    """Add the command."""
    bench = add_top_command(
        commands,
        "bench",
        "  vla-deploy bench bus --json\n  vla-deploy bench twin\n",
    )
    listed = "; ".join(f"{name}: {summary}" for name, summary in BENCHMARKS.items())
    bench.add_argument("benchmark", choices=sorted(BENCHMARKS), help=listed)
    bench.add_argument("--json", action="store_true", help="print the figures as JSON")
    bench.add_argument(
        "--part",
        action="append",
        help="of dashboard, perception, planner, speech: only this, repeatable",
    )
    bench.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run one benchmark in a process of its own."""
    command = [sys.executable, "-m", f"benchmarks.{arguments.benchmark}"]
    if arguments.json:
        command.append("--json")
    for part in arguments.part or ():
        command += ["--part", part]
    return subprocess.run(command, check=False).returncode
