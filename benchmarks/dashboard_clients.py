"""Measure what fifty clients, one of them frozen, cost control and the dashboard.

The robot is the real processes on a twin. Spans without and with clients take turns, so that what
else the computer does falls on both. `late_ratio_...` is the share of control's late ticks, as
control counts them, at a real-time priority where this is permitted; `cpu_ratio_...` is the
dashboard's share of one core. `connected` clients are subscribed to what the view Now shows,
`looking` ones to what the view Robot shows, camera included. The clients run in a process of low
priority; still they take a part of this computer.
"""

import statistics
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import psutil

from benchmarks.load_process import load_process
from drivers.clock import NS_PER_S
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.harness.cores import REALTIME_PRIORITY, realtime
from sim_twin.harness.live_robot import live_robot
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc.topics import CONTROL_STATUS, DASHBOARD_STATUS

CLIENTS: Final = 50
FROZEN: Final = 1
VIEWS: Final[Mapping[str, tuple[str, ...]]] = {
    "alone": (),
    "connected": (
        "control_status",
        "process_table",
        "budget",
        "executor_status",
        "planner_status",
        "speech_status",
        "task_event",
        "heard",
    ),
    "looking": ("control_status", "joint_state", "pose", "scan", "scene", "path", "camera"),
}
_ROUNDS: Final = 3
_SETTLE_S: Final = 3.0
_START_S: Final = 90.0


class NotServed(Exception):
    """Say that there is no dashboard to measure."""


def measure(seconds: float = 60.0) -> dict[str, Any]:
    """Return ratios, memory and traffic; each view is measured for `seconds` in all."""
    with realtime() as permitted:
        priority = REALTIME_PRIORITY if permitted else 0
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        live_robot(Path(folder), realtime_priority=priority) as robot,
    ):
        robot.arm()
        return {"realtime": permitted, **_measure(robot.session, seconds / _ROUNDS)}


def _measure(session: RobotSession, seconds: float) -> dict[str, Any]:
    process, address = _dashboard(session)
    spans: dict[str, list[dict[str, float]]] = {view: [] for view in VIEWS}
    for _ in range(_ROUNDS):
        for view, topics in VIEWS.items():
            with _clients(session.base, address, topics) as told:
                session.pause(_SETTLE_S)
                span = _span(session, process, seconds)
            spans[view].append(span | told)  # told once the clients have gone
    report: dict[str, Any] = {"clients": CLIENTS, "frozen": FROZEN, "seconds": seconds * _ROUNDS}
    for view, found in spans.items():
        for figure in found[0]:
            values = [one[figure] for one in found]
            report[f"{figure}_{view}"] = statistics.median(values)
        report[f"late_ratios_{view}"] = [one["late_ratio"] for one in found]
    return report


def _span(session: RobotSession, process: psutil.Process, seconds: float) -> dict[str, float]:
    before, cpu = _ticks(session), process.cpu_times()
    began_ns = session.clock.now_ns()
    session.pause(seconds)
    after, then = _ticks(session), process.cpu_times()
    spent_s = then.user + then.system - cpu.user - cpu.system
    took_s = (session.clock.now_ns() - began_ns) / NS_PER_S
    return {
        "late_ratio": after.since(before).late_ratio,
        "cpu_ratio": spent_s / took_s,
        "memory_mb": process.memory_info().rss / 2**20,
    }


def _ticks(session: RobotSession) -> TickWatch:
    status = session.document(CONTROL_STATUS)
    return TickWatch.of(status or {})


def _dashboard(session: RobotSession) -> tuple[psutil.Process, tuple[str, str]]:
    deadline_ns = session.clock.now_ns() + round(_START_S * NS_PER_S)
    while (sample := session.fresh(DASHBOARD_STATUS, age_limit_s=5.0)) is None:
        if session.clock.now_ns() > deadline_ns:
            raise NotServed("the dashboard tells no address; see `vla-deploy logs dashboard`")
        session.pause()
    url = urlsplit(sample.document()["url"])
    return psutil.Process(sample.writer_pid), (str(url.hostname), str(url.port))


@contextmanager
def _clients(
    base: Path, address: tuple[str, str], topics: tuple[str, ...]
) -> Iterator[dict[str, float]]:
    """Keep clients connected; what came to them is told at the end."""
    told: dict[str, float] = {"bytes_s": 0.0, "ended": 0, "frozen_cut_off": 0}
    if not topics:
        yield told
        return
    words = (*address, str(CLIENTS), str(FROZEN), ",".join(topics), str(base))
    failure = NotServed("the clients could not connect")
    with load_process("benchmarks.live_clients", words, told, failure):
        yield told
