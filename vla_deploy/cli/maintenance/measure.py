"""`vla-deploy bench | validate`: start a benchmark, or a campaign against the twin.

Both are started by name: the robot's code never imports benchmarks or twin.
"""

import argparse
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.commands import add_top_command, number_above_zero, whole_number

BENCHMARKS: Final = {
    "bus": "16-servo cycle against dynamixel-sdk on the same emulated bus",
    "contact": "torque that no contact explains while the robot works, against its limits",
    "control": "CPU time of a control tick by stage: at rest, driving, arms moving",
    "dashboard": "what clients cost control, one of them frozen; its stop to the wire; --part",
    "estop": "emergency stop: from the request to the wire under load, and to standstill",
    "perception": "how well, how fast and at what cost the robot sees; int8 against fp32; --part",
    "planner": "commands understood, other talk left alone, attacks refused, time to plan; --part",
    "recorder": "what the flight recorder costs: per control tick, per look, per flight",
    "ros": "the ROS gateway: its share of a core, its latency, late ticks with and without it",
    "serial": "a serial port's bytes on busy cores, with the kernel's workers raised and not",
    "speech": "words understood by voice and noise, from speech to text, what it costs; --part",
    "ticks": "late control ticks, idle and under load, with and without SCHED_FIFO",
    "twin": "twin steps against raw mj_step, and the lock-step real-time factor",
}
CAMPAIGNS: Final = {
    "agents": "hostile calls of AI agents, with and without a lease, judged by physics",
    "demos": "the job of `demo` in one random scene after the other; --robot, --count, --seed",
    "faults": "every fault in every phase of the work, on the lock-step twin",
    "kills": "kill -9, SIGSTOP and SIGTERM of every process at random moments",
    "load": "the main job repeatedly, with eight busy loops: only its duration may change",
    "missions": "whole missions in lock-step: side by side, paused, as the documents have them",
    "navigation": "drives around what is on no map, following, sweeping, guarding, inspecting",
    "power-cuts": "the power goes at each operation of `release`: what boots has to run",
    "pressure": "too little memory, CPU, disk, cooling or power, and a clock that jumps",
    "switches": "hot profile switches under motion, and bad profiles",
    "soak": "hours of work in lock-step: memory, files and threads must not grow",
    "stops": "every source of a stop in every phase: to the wire, to rest; --short, --report",
    "suite": "named scenes of one suite, or of all, with scores; --html, --compare, --ray",
}
SUITES: Final = {
    "voice": "spoken commands, understood and executed",
    "navigation": "drives, around a chair, past somebody, following",
    "manipulation": "the jobs of `demo` of Butler and of an arm on a table, a bottle from the side",
    "integration": "whole missions, also side by side and paused",
    "safety": "stops, a shove, and a few faults in motion",
    "all": "all of them",
}
_BENCH_EXAMPLES: Final = "  vla-deploy bench bus --family feetech --json\n  vla-deploy bench twin\n"
_VALIDATE_EXAMPLES: Final = """  vla-deploy validate demos --robot so101
  vla-deploy validate faults --only servo_bus --json
  vla-deploy validate kills --count 20 --junit out/kills.xml
  vla-deploy validate stops --short --report out
  vla-deploy validate suite all --html out/suite.html
  vla-deploy validate suite manipulation --only side_grasp --count 10
  vla-deploy validate suite navigation --json --compare out/earlier.json
"""
_PASSED_ON: Final = (
    *("only", "count", "hours", "seed", "workers", "junit", "robot"),
    *("html", "compare", "ray", "report"),
)


def register(commands: Any) -> None:
    """Add the commands."""
    bench = add_top_command(
        commands, "bench", _BENCH_EXAMPLES, run_bench, json_help="print the figures as JSON"
    )
    bench.add_argument("benchmark", choices=sorted(BENCHMARKS), help=_listed(BENCHMARKS))
    bench.add_argument(
        "--part",
        action="append",
        help="of dashboard, perception, planner, speech: only this, repeatable",
    )
    bench.add_argument("--family", help="of bus: the servos' family, dynamixel or feetech")
    validate = add_top_command(
        commands, "validate", _VALIDATE_EXAMPLES, run_campaign, json_help="print the report as JSON"
    )
    validate.add_argument("campaign", choices=tuple(CAMPAIGNS), help=_listed(CAMPAIGNS))
    validate.add_argument(
        "suite", nargs="?", choices=tuple(SUITES), help=f"of suite; {_listed(SUITES)}"
    )
    validate.add_argument("--only", metavar="TEXT", help="only cases whose name contains this")
    validate.add_argument(
        "--count", type=whole_number(), help="how many injections, switches, or stops"
    )
    validate.add_argument(
        "--hours", type=number_above_zero("hours"), help="how long to soak (default: 1)"
    )
    validate.add_argument(
        "--workers",
        type=whole_number(),
        help="how many cases at a time (default: 2; of suite: one a core)",
    )
    validate.add_argument("--robot", help="of demos, faults, kills, load, stops (default: butler)")
    validate.add_argument("--seed", type=int, help="of the random moments (default: 0)")
    validate.add_argument("--junit", type=Path, metavar="FILE", help="write JUnit XML too")
    validate.add_argument(
        "--html", type=Path, metavar="FILE", help="of suite: write a page with plots too"
    )
    validate.add_argument(
        "--report", type=Path, metavar="DIR", help="of stops: write a page, JSON and a table there"
    )
    validate.add_argument(
        "--short", action="store_true", help="of stops: a minute's worth of cells"
    )
    validate.add_argument(
        "--compare", type=Path, metavar="FILE", help="of suite: a report that --json printed before"
    )
    validate.add_argument(
        "--ray",
        nargs="?",
        const="local",
        metavar="ADDRESS",
        help="of suite: play on a Ray cluster; without ADDRESS on one of this computer",
    )


def _listed(summaries: Mapping[str, str]) -> str:
    return "; ".join(f"{name}: {summary}" for name, summary in summaries.items())


def run_bench(arguments: argparse.Namespace) -> int:
    """Run one benchmark in a process of its own."""
    command = [sys.executable, "-m", f"benchmarks.{arguments.benchmark}"]
    if arguments.json:
        command.append("--json")
    for part in arguments.part or ():
        command += ["--part", part]
    if arguments.family is not None:
        command += ["--family", arguments.family]
    return subprocess.run(command, check=False).returncode


def run_campaign(arguments: argparse.Namespace) -> int:
    """Replace this process by the campaign, so that it gets the signals; 1 where a case failed."""
    command = [sys.executable, "-m", "sim_twin.campaigns", arguments.campaign]
    command += [arguments.suite] if arguments.suite else []
    for name in _PASSED_ON:
        value = vars(arguments)[name]
        if value is not None:
            command += [f"--{name}", str(value)]
    command += ["--short"] if arguments.short else []
    if arguments.json:
        command.append("--json")
    os.execv(sys.executable, command)
