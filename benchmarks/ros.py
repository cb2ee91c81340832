"""Measure the ROS gateway: its share of a core, how old what it tells is, what control loses by it.

The robot runs on its twin by the wall clock; a listener in a process of its own takes joint states
at 100 Hz, odometry, frames, the scan, diagnostics, and both images at 10 Hz. Beside that: a node
that publishes the same joint states and nothing else (`peer_core_share`), and control's late ticks
of a robot without the gateway, in a run just before (`late_ratio_without`): `late_ticks_added` is
what the gateway's run had more, of as many ticks.
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
from benchmarks.core import REALTIME_PRIORITY, realtime
from benchmarks.live_robot import arm, live_stack
from benchmarks.percentiles import percentile
from platforms import load_profile
from sim_twin.harness.process_stack import ProcessStack
from vla_deploy.cli.session import RobotSession
from vla_deploy.gateways.ros.launching import launch_environment
from vla_deploy.robots import load_robot
from vla_deploy.robots.ros_settings import RosSettings

GOAL_CORE_SHARE: Final = 0.15
RATE_HZ: Final = 100.0
_ROS: Final = f"""
[ros]
joint_state_rate_hz = {RATE_HZ:g}
image_rate_hz = 10
"""
_SETTLE_S: Final = 3.0
_HERE: Final = Path(__file__).parent


def measure(seconds: float) -> dict[str, Any]:
    """Return the figures."""
    with tempfile.TemporaryDirectory(prefix="vla-") as name:
        folder = Path(name)
        robot = _robot(folder / "butler")
        profile = _profile()
        with live_stack(folder, profile, "--robot", str(robot)) as (_, session):
            arm(session)
            without = _late_ratio(session, seconds, lambda: session.pause(seconds))
        options = ("--robot", str(robot), "--ros")
        with live_stack(folder, profile, *options) as (stack, session):
            arm(session)
            report = _with_gateway(stack, session, folder, seconds)
            ticks = load_profile("desktop").control_rate_hz * seconds
            added = max(0.0, report["late_ratio_with"] - without) * ticks
            return report | {
                "seconds": seconds,
                "goal_core_share": GOAL_CORE_SHARE,
                "late_ratio_without": without,
                "late_ticks_added": round(added),
            }


def _with_gateway(
    stack: ProcessStack, session: RobotSession, folder: Path, seconds: float
) -> dict[str, Any]:
    python, variables = _environment(folder)
    session.pause(_SETTLE_S)
    process = psutil.Process(int(stack.row("ros")["pid"]))
    listener = _begin(python, variables, "ros_listener.py", seconds)
    session.pause(_SETTLE_S)  # until it has found everything
    before_s, told = _spent_s(process), {}
    span_s = seconds - 2 * _SETTLE_S

    def wait() -> None:
        began_ns = session.clock.now_ns()
        session.pause(span_s)
        told["span_s"] = (session.clock.now_ns() - began_ns) / 1e9

    late = _late_ratio(session, span_s, wait)
    share = (_spent_s(process) - before_s) / told["span_s"]
    memory_mb = process.memory_info().rss / 1e6
    heard = json.loads(listener.communicate()[0])
    peer = _begin(python, variables, "ros_peer.py", 10.0, RATE_HZ, 16)
    ages_s = sorted(heard["ages_s"])
    return {
        "core_share": share,
        "peer_core_share": json.loads(peer.communicate()[0])["core_share"],
        "memory_mb": memory_mb,
        "late_ratio_with": late,
        "latency_p50_s": percentile(ages_s, 50),
        "latency_p99_s": percentile(ages_s, 99),
        "heard": heard["counts"],
    }


def _late_ratio(session: RobotSession, seconds: float, wait: Any) -> float:
    before = session.document("control_status") or {}
    wait()
    after = session.document("control_status") or {}
    ticks = after["tick"] - before["tick"]
    return float((after["late_ticks"] - before["late_ticks"]) / ticks)


def _robot(folder: Path) -> Path:
    """Copy the robot, with the rates that are measured."""
    shutil.copytree(load_robot("butler").mjcf_path.parent, folder)
    file = folder / "robot.toml"
    file.write_text(file.read_text(encoding="utf-8") + _ROS, encoding="utf-8")
    return folder


def _profile() -> str:
    with realtime() as permitted:
        priority = REALTIME_PRIORITY if permitted else 0
    rates = "camera_rate_hz = 10\nperception_rate_hz = 10\n"
    return f'inherits = "desktop"\nrealtime_priority = {priority}\n{rates}'


def _environment(folder: Path) -> tuple[Path, Mapping[str, str]]:
    python, variables = launch_environment(RosSettings(), folder)
    return python, {**os.environ, **variables}


def _begin(
    python: Path, variables: Mapping[str, str], script: str, *arguments: float
) -> "subprocess.Popen[str]":
    words = [str(python), str(_HERE / script), *(f"{one:g}" for one in arguments)]
    return subprocess.Popen(words, env=dict(variables), stdout=subprocess.PIPE, text=True)


def _spent_s(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("ros", __doc__)
    arguments.add_argument("--seconds", type=float, default=30.0, help="of each robot")
    options = arguments.parse_args(argv)
    show(measure(options.seconds), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
