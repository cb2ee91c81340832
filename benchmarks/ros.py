"""Measure the ROS gateway: its share of a core, how old what it tells is, what control loses by it.

The robot runs on its twin by the wall clock; a listener in a process of its own takes joint states
at 100 Hz, odometry, frames, the scan, diagnostics, and both images at 10 Hz. Beside that: a node
that publishes the same joint states and nothing else (`peer_core_share`), and control's late ticks
by turns of a few seconds with the gateway at work and with it frozen, so that what else the
computer does meets both alike: `late_ticks_added` is what the gateway's turns had more.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import psutil

from benchmarks.command import parser, show
from benchmarks.percentiles import percentile
from drivers.clock import NS_PER_S
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.harness.cores import REALTIME_PRIORITY, realtime
from sim_twin.harness.live_robot import live_stack
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import topics
from vla_deploy.robots import load_robot
from vla_deploy.robots.ros_settings import RosSettings
from vla_deploy.supervisor.processes.ros_environment import launch_environment

GOAL_CORE_SHARE: Final = 0.15
RATE_HZ: Final = 100.0
_ROS: Final = f"""
[ros]
joint_state_rate_hz = {RATE_HZ:g}
image_rate_hz = 10
"""
_SETTLE_S: Final = 3.0
_SHORT_S: Final = 0.5
_WINDOW_S: Final = 7.0
"""With what precedes it shorter than the silence by which the supervisor takes it for hung."""
_HERE: Final = Path(__file__).parent
Environment = tuple[Path, Mapping[str, str]]


def measure(seconds: float, rounds: int) -> dict[str, Any]:
    """Return the figures; `seconds` are for share and latency, `rounds` for late ticks."""
    with tempfile.TemporaryDirectory(prefix="vla-") as name:
        folder = Path(name)
        options = ("--robot", str(_robot(folder / "butler")), "--ros")
        with live_stack(folder, _profile(), *options) as robot:
            robot.arm()
            robot.pause(_SETTLE_S)
            process = psutil.Process(int(robot.row("ros")["pid"]))
            environment = _environment(folder)
            report = _share_and_latency(robot.session, process, environment, seconds)
            return report | _late_ticks(robot.session, process, environment, rounds)


def _share_and_latency(
    session: RobotSession, process: psutil.Process, environment: Environment, seconds: float
) -> dict[str, Any]:
    listener = _begin(environment, "ros_listener.py", seconds)
    session.pause(_SETTLE_S)  # until it has found everything
    began_ns, before_s = session.clock.now_ns(), _spent_s(process)
    session.pause(seconds - 2 * _SETTLE_S)
    share = (_spent_s(process) - before_s) / ((session.clock.now_ns() - began_ns) / NS_PER_S)
    heard = json.loads(listener.communicate()[0])
    peer = _begin(environment, "ros_peer.py", 10.0, RATE_HZ, 16)
    ages_s = sorted(heard["ages_s"])
    return {
        "core_share": share,
        "goal_core_share": GOAL_CORE_SHARE,
        "peer_core_share": json.loads(peer.communicate()[0])["core_share"],
        "memory_mb": process.memory_info().rss / 1e6,
        "latency_p50_s": percentile(ages_s, 50),
        "latency_p99_s": percentile(ages_s, 99),
        "heard": heard["counts"],
        "seconds": seconds,
    }


def _late_ticks(
    session: RobotSession, process: psutil.Process, environment: Environment, rounds: int
) -> dict[str, Any]:
    """Count control's late ticks by turns: with the gateway at work, and with it frozen."""
    listener = _begin(environment, "ros_listener.py", rounds * 2 * (_SETTLE_S + _WINDOW_S))
    late = {"with": 0, "without": 0}
    ticks = 0
    for _ in range(rounds):
        process.suspend()
        session.pause(_SHORT_S)
        late["without"] += _counted(session).late
        process.resume()
        session.pause(_SETTLE_S)
        counted = _counted(session)
        late["with"] += counted.late
        ticks += counted.ticks
    listener.kill()
    listener.communicate()
    return {
        "late_ticks_with": late["with"],
        "late_ticks_without": late["without"],
        "late_ticks_added": max(0, late["with"] - late["without"]),
        "ticks": ticks,
    }


def _counted(session: RobotSession) -> TickWatch:
    """Return the ticks of a window."""
    before = session.document(topics.CONTROL_STATUS)
    session.pause(_WINDOW_S)
    after = session.document(topics.CONTROL_STATUS)
    return TickWatch.of(after or {}).since(TickWatch.of(before or {}))


def _robot(folder: Path) -> Path:
    """Copy the robot, with the rates that are measured."""
    shutil.copytree(load_robot("butler").folder, folder)
    file = folder / "robot.toml"
    file.write_text(file.read_text(encoding="utf-8") + _ROS, encoding="utf-8")
    return folder


def _profile() -> str:
    with realtime() as permitted:
        priority = REALTIME_PRIORITY if permitted else 0
    rates = "camera_rate_hz = 10\nperception_rate_hz = 10\n"
    return f'inherits = "desktop"\nrealtime_priority = {priority}\n{rates}'


def _environment(folder: Path) -> Environment:
    python, variables = launch_environment(RosSettings(), folder)
    return python, {**os.environ, **variables}


def _begin(environment: Environment, script: str, *arguments: float) -> "subprocess.Popen[str]":
    python, variables = environment
    words = [str(python), str(_HERE / script), *(f"{one:g}" for one in arguments)]
    return subprocess.Popen(words, env=dict(variables), stdout=subprocess.PIPE, text=True)


def _spent_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("ros", __doc__)
    arguments.add_argument("--seconds", type=float, default=30.0, help="for share and latency")
    arguments.add_argument("--rounds", type=int, default=6, help="with and without, by turns")
    options = arguments.parse_args(argv)
    show(measure(options.seconds, options.rounds), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
